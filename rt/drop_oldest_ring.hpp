// A bounded queue between two threads in which the newest wins: full, the oldest goes back.
//
// Design. As SpscRing, but the producer too may take from the front, so the head has two writers and moves by
// compare-and-swap; whoever moves it from h to h + 1 owns item h, exactly one of the two.
//
//                 head_ (either side, CAS)   tail_ (producer)
//                   v                          v
//                 [ h ][ . ][ . ][ . ]
//   push, full:   1. CAS head h -> h + 1: the oldest is ours and goes back to the caller
//                 2. store the new item in the slot just freed
//                 3. tail + 1
//   pop:          read slot of h, then CAS head h -> h + 1: only if that succeeds was what we read ours.
//
// What can go wrong, and why it does not:
// - The consumer reads slot h while the producer evicts h and overwrites the slot (h + N is the same slot).
//   Then head is no longer h, the consumer's CAS fails, and what it read is never looked at. Slots are
//   therefore atomics of at most 8 bytes (a FrameId): the losing read is a defined read, not a torn one.
// - ABA: positions only grow (64 bits), so a head that equals h was never anything else since.
// - The consumer's CAS succeeds although it read the newer item: the producer writes position h + N only
//   after it moved head past h itself (then our CAS fails) or saw, with acquire, that we had moved it, and
//   our read of the slot comes before our releasing CAS. So a read before a successful CAS is never too new.
// - The producer's CAS fails: only the consumer can have moved head, and that made room. So push has no loop.
//
// push: wait-free. try_pop: lock-free; it repeats only when the producer evicted in between, that is once per
// push into a full ring during one pop.
#pragma once

#include <array>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <type_traits>

#include "rt/atomics.hpp"
#include "rt/edge.hpp"
#include "rt/slice.hpp"

namespace tactus::rt {

/// First in, first out, kCapacity ids. What is dropped comes back, so that the producer can return the frame
/// to its pool.
template <typename T, std::size_t kCapacity, typename Atomics = StdAtomics>
class DropOldestRing {
  static_assert(std::has_single_bit(kCapacity));
  static_assert(std::is_trivially_copyable_v<T> && std::atomic<T>::is_always_lock_free,
                "ids travel, frames do not");

 public:
  class Producer : public EdgeEnd<DropOldestRing> {
   public:
    using EdgeEnd<DropOldestRing>::EdgeEnd;
    /// Always takes `item`. Full: answers the oldest, which is the caller's again. Step, the producing
    /// thread, wait-free.
    [[nodiscard]] std::optional<T> push(T item) noexcept { return this->edge().push(item); }
  };

  class Consumer : public EdgeEnd<DropOldestRing> {
   public:
    using EdgeEnd<DropOldestRing>::EdgeEnd;
    /// The oldest item, or nothing. Step, the consuming thread, lock-free.
    [[nodiscard]] std::optional<T> try_pop() noexcept { return this->edge().try_pop(); }
  };

  /// Asserts when another producer (consumer) is alive. Any thread.
  Producer producer() noexcept { return Producer(*this, producer_latch_); }
  Consumer consumer() noexcept { return Consumer(*this, consumer_latch_); }

  [[nodiscard]] EdgeCounts was() const noexcept { return counter_.was(); }
  static constexpr std::size_t capacity() { return kCapacity; }

 private:
  std::optional<T> push(T item) noexcept {
    std::optional<T> oldest;
    // Relaxed: our own variable, nobody else writes it.
    const std::uint64_t tail = tail_.load(std::memory_order_relaxed);
    // Pairs with the release of the consumer's CAS: it has read a slot before we overwrite it.
    std::uint64_t head = head_.load(std::memory_order_acquire);
    if (tail - head == kCapacity) {
      // Relaxed: we wrote this slot ourselves.
      const T victim = slots_[head % kCapacity].load(std::memory_order_relaxed);
      // Success takes the item from the consumer, whose CAS then fails and who uses nothing it read. Failure,
      // acquire, pairs with the release of the consumer's CAS as the load above does. (Success needs no order
      // of its own; the compiler does not take a weaker one than for failure.)
      if (head_.compare_exchange_strong(head, head + 1, std::memory_order_acquire,
                                        std::memory_order_acquire)) {
        oldest = victim;
        counter_.count_dropped();
        ++head;
      }
    }
    // Relaxed: published by the store of tail.
    slots_[tail % kCapacity].store(item, std::memory_order_relaxed);
    // Pairs with the acquire in try_pop: whoever sees the new tail sees the item, and what the producer wrote
    // before it.
    tail_.store(tail + 1, std::memory_order_release);
    counter_.count_pushed(tail + 1 - head);
    return oldest;
  }

  std::optional<T> try_pop() noexcept {
    // Relaxed: only a guess, which the CAS confirms.
    std::uint64_t head = head_.load(std::memory_order_relaxed);
    for (;;) {
      // Pairs with the release in push: items before tail are there to be read.
      const std::uint64_t tail = tail_.load(std::memory_order_acquire);
      // A head learnt from a failed CAS can be ahead of an older tail: nothing for us either.
      if (head >= tail) return std::nullopt;
      // Relaxed: came with tail; may be a later item when we were overtaken, then the CAS fails.
      const T item = slots_[head % kCapacity].load(std::memory_order_relaxed);
      // Release pairs with the acquire of head in push: our read of the slot is over before it is
      // overwritten. Failure is relaxed: the new head is a guess again.
      if (head_.compare_exchange_strong(head, head + 1, std::memory_order_release, std::memory_order_relaxed))
        return item;
    }
  }

  alignas(kCacheLineBytes) typename Atomics::template Atomic<std::uint64_t> tail_{0};
  EdgeCounter counter_;
  EndLatch producer_latch_;
  alignas(kCacheLineBytes) typename Atomics::template Atomic<std::uint64_t> head_{0};
  EndLatch consumer_latch_;
  alignas(kCacheLineBytes) std::array<typename Atomics::template Atomic<T>, kCapacity> slots_{};
};

}  // namespace tactus::rt
