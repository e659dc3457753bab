// Which atomics a lock-free type is made of: the standard's, or in its tests a model that explores every
// interleaving.
#pragma once

#include <atomic>

namespace tactus::rt {

struct StdAtomics {
  template <typename T>
  using Atomic = std::atomic<T>;
};

}  // namespace tactus::rt
