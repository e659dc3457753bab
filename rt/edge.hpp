// What all edges share: ends that only one owner can hold, and counts that anyone may read.
#pragma once

#include <atomic>
#include <cstdint>
#include <utility>

#include "rt/assert.hpp"

namespace tactus::rt {

struct EdgeCounts {
  std::uint64_t pushed = 0;      ///< accepted from the producer
  std::uint64_t dropped = 0;     ///< refused, pushed out or overwritten before anyone read it
  std::uint64_t high_water = 0;  ///< most items that ever waited at once
};

/// Any thread. Relaxed throughout: each count is a value of its own that orders nothing, so the three may be
/// of slightly different moments; hence was(). Kept outside the algorithms: no decision depends on them.
class EdgeCounter {
 public:
  void count_pushed(std::uint64_t waiting) noexcept {
    pushed_.fetch_add(1, std::memory_order_relaxed);
    // Ends: each round another thread raised the mark, and it only rises to what really waited.
    std::uint64_t mark = high_water_.load(std::memory_order_relaxed);
    while (waiting > mark && !high_water_.compare_exchange_weak(mark, waiting, std::memory_order_relaxed)) {
    }
  }
  void count_dropped() noexcept { dropped_.fetch_add(1, std::memory_order_relaxed); }
  [[nodiscard]] std::uint64_t high_water() const noexcept {
    return high_water_.load(std::memory_order_relaxed);
  }
  [[nodiscard]] EdgeCounts was() const noexcept {
    return {pushed_.load(std::memory_order_relaxed), dropped_.load(std::memory_order_relaxed),
            high_water_.load(std::memory_order_relaxed)};
  }

 private:
  std::atomic<std::uint64_t> pushed_{0};
  std::atomic<std::uint64_t> dropped_{0};
  std::atomic<std::uint64_t> high_water_{0};
};

/// Held by whoever owns an end of an edge; a second owner is a wiring mistake and asserts.
class EndLatch {
 public:
  // Pairs with release(): the next owner (a restarted thread) sees what the one before left in the end's own
  // fields.
  void acquire() noexcept { TACTUS_ASSERT(!is_taken_.exchange(true, std::memory_order_acquire)); }
  void release() noexcept { is_taken_.store(false, std::memory_order_release); }

 private:
  std::atomic<bool> is_taken_{false};
};

/// Ownership of one end: move-only, gives the end back when destroyed. The ends of an edge derive their
/// methods from it.
template <typename Edge>
class EdgeEnd {
 public:
  EdgeEnd(Edge& edge, EndLatch& latch) noexcept : edge_(&edge), latch_(&latch) { latch.acquire(); }
  EdgeEnd(EdgeEnd&& other) noexcept : edge_(std::exchange(other.edge_, nullptr)), latch_(other.latch_) {}
  EdgeEnd& operator=(EdgeEnd&& other) noexcept {
    if (this == &other) return *this;
    give_back();
    edge_ = std::exchange(other.edge_, nullptr);
    latch_ = other.latch_;
    return *this;
  }
  ~EdgeEnd() { give_back(); }

 protected:
  [[nodiscard]] Edge& edge() const noexcept { return *edge_; }

 private:
  void give_back() noexcept {
    if (edge_ != nullptr) latch_->release();
  }
  Edge* edge_;
  EndLatch* latch_;
};

}  // namespace tactus::rt
