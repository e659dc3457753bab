// XNNPACK brings its own heap: this fences it in. All it ever allocates comes from one fixed piece of planned
// memory.
#pragma once

#include <cstddef>
#include <span>

#include "rt/status.hpp"

namespace tactus::segment {

/// A stack of blocks in fixed memory. XNNPACK allocates while operators are created and set up (about three
/// blocks each: the operator, its packed weights, its indirection table) and never while they run, so nothing
/// needs to be found again: a block is cut from the front of the free memory, and given back only when it is
/// the last one. What is freed in between is lost until the whole pool goes (measured on the nets here: 0
/// bytes). Boot only, one thread.
class XnnPool {
 public:
  XnnPool() = default;
  explicit XnnPool(std::span<std::byte> memory) : memory_(memory) {}

  void* allocate(std::size_t bytes) noexcept;
  void* reallocate(void* block, std::size_t bytes) noexcept;
  void deallocate(void* block) noexcept;

  [[nodiscard]] std::size_t bytes_used() const { return used_; }
  [[nodiscard]] std::size_t bytes_high_water() const { return high_water_; }
  [[nodiscard]] std::size_t bytes_capacity() const { return memory_.size(); }
  [[nodiscard]] std::size_t blocks_count() const { return blocks_count_; }
  [[nodiscard]] std::size_t refusals_count() const { return refusals_count_; }

 private:
  std::span<std::byte> memory_;
  std::size_t used_ = 0;
  std::size_t high_water_ = 0;
  std::size_t blocks_count_ = 0;    // allocate calls that were served
  std::size_t refusals_count_ = 0;  // allocate calls that did not fit
};

/// While it lives, XNNPACK allocates on this thread from `pool`; outside of it, every XNNPACK allocation is
/// refused. (XNNPACK takes one allocator per process and no context per operator, so the pool in use is a
/// thread-local.)
class XnnPoolScope {
 public:
  explicit XnnPoolScope(XnnPool& pool) noexcept;
  ~XnnPoolScope();
  XnnPoolScope(const XnnPoolScope&) = delete;
  XnnPoolScope& operator=(const XnnPoolScope&) = delete;

 private:
  XnnPool* outer_;
};

/// Starts XNNPACK with the fenced allocator; may be called again. Error: the processor lacks what XNNPACK
/// needs, or another part of the process has started XNNPACK with its own allocator. Phase: boot.
rt::Result<void> initialize_xnnpack();

}  // namespace tactus::segment
