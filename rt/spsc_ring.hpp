// A bounded queue between two threads that loses nothing: when it is full the producer is told.
//
// Design (Lamport 1983, with the cached positions of Giacomoni et al. 2008, "FastForward", and Rigtorp):
//
//        head_ (consumer writes)          tail_ (producer writes)
//          v                                v
//   [ . ][ a ][ b ][ c ][ d ][ . ][ . ][ . ]      slot = position mod N;  waiting = tail - head <= N
//
// Positions only grow: 64 bits at a million items a second last 584 000 years, so wrap-around needs no
// argument, and full (tail - head == N) differs from empty (tail == head) without wasting a slot.
//
// A slot belongs to the producer while its position is outside [head, tail) and to the consumer while inside.
// Ownership changes hands twice, each time by a release store of a position and an acquire load of it:
//   producer fills slot -> tail_.store(release)  =>  consumer tail_.load(acquire) -> reads slot
//       without it the consumer could see the new tail and the old contents of the slot;
//   consumer empties slot -> head_.store(release) => producer head_.load(acquire) -> overwrites slot
//       without it the producer's overwriting could become visible before the consumer's reading was done.
//
// Each side keeps a copy of the other's position and reads the real one only when the copy says full or
// empty: in steady state no cache line bounces but the slots'. A stale copy errs on the safe side: it shows
// less room, fewer items. Both operations are wait-free: no loop. The counts order nothing.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "rt/atomics.hpp"
#include "rt/edge.hpp"
#include "rt/slice.hpp"

namespace tactus::rt {

/// First in, first out, kCapacity items of T by copy. Place it in planned memory; take both ends at boot.
template <typename T, std::size_t kCapacity, typename Atomics = StdAtomics>
class SpscRing {
  static_assert(std::has_single_bit(kCapacity));
  static_assert(std::is_nothrow_copy_assignable_v<T> && std::is_trivially_destructible_v<T>);

 public:
  class Producer : public EdgeEnd<SpscRing> {
   public:
    using EdgeEnd<SpscRing>::EdgeEnd;
    /// False, and counted as dropped, when full. Step, the producing thread, wait-free.
    [[nodiscard]] bool try_push(const T& item) noexcept { return this->edge().try_push(item); }
  };

  class Consumer : public EdgeEnd<SpscRing> {
   public:
    using EdgeEnd<SpscRing>::EdgeEnd;
    /// False, and `item` unchanged, when empty. Step, the consuming thread, wait-free.
    [[nodiscard]] bool try_pop(T& item) noexcept { return this->edge().try_pop(item); }
  };

  /// Asserts when another producer (consumer) is alive. Any thread.
  Producer producer() noexcept { return Producer(*this, producer_latch_); }
  Consumer consumer() noexcept { return Consumer(*this, consumer_latch_); }

  [[nodiscard]] EdgeCounts was() const noexcept { return counter_.was(); }
  static constexpr std::size_t capacity() { return kCapacity; }

 private:
  bool try_push(const T& item) noexcept {
    // Relaxed: our own variable, nobody else writes it.
    const std::uint64_t tail = tail_.load(std::memory_order_relaxed);
    if (tail - head_seen_ == kCapacity) {
      // Pairs with the release in try_pop: the consumer is done with the slot before we overwrite it.
      head_seen_ = head_.load(std::memory_order_acquire);
      if (tail - head_seen_ == kCapacity) {
        counter_.count_dropped();
        return false;
      }
    }
    slots_[tail % kCapacity] = item;
    // Pairs with the acquire in try_pop: whoever sees the new tail sees the slot's contents.
    tail_.store(tail + 1, std::memory_order_release);
    // The copy of head may be old and show too much waiting: look again before a new record is believed.
    // Relaxed: for counting only, and not kept, so it hands no slot over.
    std::uint64_t waiting = tail + 1 - head_seen_;
    if (waiting > counter_.high_water()) waiting = tail + 1 - head_.load(std::memory_order_relaxed);
    counter_.count_pushed(waiting);
    return true;
  }

  bool try_pop(T& item) noexcept {
    // Relaxed: our own variable, nobody else writes it.
    const std::uint64_t head = head_.load(std::memory_order_relaxed);
    if (head == tail_seen_) {
      // Pairs with the release in try_push: the slot's contents come with the tail.
      tail_seen_ = tail_.load(std::memory_order_acquire);
      if (head == tail_seen_) return false;
    }
    item = slots_[head % kCapacity];
    // Pairs with the acquire in try_push: our reading is over before the producer may reuse the slot.
    head_.store(head + 1, std::memory_order_release);
    return true;
  }

  // One cache line per writing side, so that they do not slow each other down.
  alignas(kCacheLineBytes) typename Atomics::template Atomic<std::uint64_t> tail_{0};
  std::uint64_t head_seen_ = 0;
  EdgeCounter counter_;
  EndLatch producer_latch_;
  alignas(kCacheLineBytes) typename Atomics::template Atomic<std::uint64_t> head_{0};
  std::uint64_t tail_seen_ = 0;
  EndLatch consumer_latch_;
  alignas(kCacheLineBytes) std::array<T, kCapacity> slots_{};
};

}  // namespace tactus::rt
