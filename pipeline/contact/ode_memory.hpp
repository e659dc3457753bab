// ODE's heap, fenced: every byte that ODE asks for comes from one planned slice.
//
// ODE tells the size when it frees, and asks for a handful of sizes over and over (bodies, geoms, contact
// joints, the step's work area), so a free list per size class is exact and constant-time: sizes up to 4 KiB
// in classes of 64 bytes, larger ones in eighths of an octave. Fresh blocks are cut front to back; nothing is
// ever merged. What one class has freed another cannot use; the high-water mark shows what that costs
// (measured: nothing after warm-up, ODE's sizes recur).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "rt/slice.hpp"

namespace tactus::contact {

struct OdeMemoryUse {
  std::size_t capacity_bytes = 0;
  std::size_t carved_bytes =
      0;  // cut from the slice so far; never falls: the high-water mark of the plan row
  std::size_t in_use_bytes = 0;  // held by ODE now, rounded up to classes
  std::size_t in_use_bytes_max = 0;
  std::uint64_t allocations = 0;  // calls since bind
  std::uint64_t refused = 0;      // asked for when full
};

/// The pool. Not thread-safe: one thread steps the world that it serves. All calls are constant-time.
class OdePool {
 public:
  OdePool() = default;
  OdePool(rt::Slice slice, std::size_t bytes);

  [[nodiscard]] void* allocate(std::size_t bytes) noexcept;  // null when full, counted
  void free(void* block, std::size_t bytes) noexcept;
  [[nodiscard]] const OdeMemoryUse& use() const { return use_; }

 private:
  struct FreeBlock {
    FreeBlock* next;
  };
  static constexpr std::size_t kSmallClasses = 64;      // 64, 128, ... 4096 bytes
  static constexpr std::size_t kLargeClasses = 8 * 24;  // 4.5 KiB ... 64 GiB

  std::array<FreeBlock*, kSmallClasses + kLargeClasses> free_{};
  std::byte* next_ = nullptr;
  std::size_t left_bytes_ = 0;
  OdeMemoryUse use_;
};

/// Puts `pool` under ODE's allocation handlers and starts the library; stop_ode() undoes both. ODE has one
/// allocator, one random seed and one table of geom classes per process, so there is one at a time: a second
/// start asserts. Boot.
void start_ode(OdePool& pool);
void stop_ode();

}  // namespace tactus::contact
