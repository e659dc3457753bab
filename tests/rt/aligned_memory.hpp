// Memory for a Slice in tests.
#pragma once

#include <cstddef>
#include <cstdlib>
#include <memory>
#include <span>

#include "rt/slice.hpp"

namespace tactus::test {

/// Owns cache-line aligned memory; slice() starts at its front each time.
class AlignedMemory {
 public:
  explicit AlignedMemory(std::size_t bytes)
      : bytes_(rt::round_up(bytes, rt::kCacheLineBytes)),
        memory_(static_cast<std::byte*>(std::aligned_alloc(rt::kCacheLineBytes, bytes_)), &std::free) {}
  [[nodiscard]] rt::Slice slice() { return rt::Slice({memory_.get(), bytes_}); }

 private:
  std::size_t bytes_;
  std::unique_ptr<std::byte, decltype(&std::free)> memory_;
};

}  // namespace tactus::test
