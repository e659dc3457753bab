// The latest big state from one thread to one other: written in place, never torn, never waited for.
//
// Design: triple buffering with one atomic byte.
//
//   producer owns back_ <--exchange--> middle_ {slot index, fresh bit} <--exchange--> consumer owns front_
//
// The three indices are always a permutation of 0, 1, 2: each exchange swaps an index that one side owns with
// the one in the middle, so no slot ever has two owners, and the side that swaps has the slot it gets for
// itself. The producer can always publish (it gets back the middle slot, read or not); the consumer always
// keeps a whole, unchanging value.
//
// The fresh bit says that the middle was published and not yet taken: when the producer swaps it out again,
// the consumer never saw that value: overwritten, counted.
//
// Both exchanges are acquire and release at once:
// - producer's release -> consumer's acquire: the contents of the slot come with its index, else a torn read;
// - consumer's release -> producer's acquire: the consumer is done with the slot that it gives back before
//   the producer writes into it, else the consumer's late reads would see the next value.
//
// Wait-free on both sides: one exchange, no loop.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

#include "rt/atomics.hpp"
#include "rt/edge.hpp"
#include "rt/slice.hpp"

namespace tactus::rt {

/// One writer, one reader, three T. When T is big it holds spans: give each of slots_at_boot() its own
/// planned memory.
template <typename T, typename Atomics = StdAtomics>
class Mailbox {
  static_assert(std::is_trivially_destructible_v<T>, "lives in planned memory");

 public:
  class Producer : public EdgeEnd<Mailbox> {
   public:
    using EdgeEnd<Mailbox>::EdgeEnd;
    /// The slot to fill; holds an old value. Valid until publish(). Step, the writing thread, wait-free.
    [[nodiscard]] T& back() noexcept { return this->edge().slots_[this->edge().back_]; }
    /// Hands the filled slot over. False when that overwrote a value that was never read (counted as
    /// dropped).
    bool publish() noexcept { return this->edge().publish(); }
    /// For small T: copies and publishes.
    bool push(const T& value) noexcept {
      back() = value;
      return publish();
    }
  };

  class Consumer : public EdgeEnd<Mailbox> {
   public:
    using EdgeEnd<Mailbox>::EdgeEnd;
    /// Takes the newest value if there is one newer than front(); answers whether. Step, the reading thread,
    /// wait-free.
    bool refresh() noexcept { return this->edge().refresh(); }
    /// False before anything was taken.
    [[nodiscard]] bool has_value() const noexcept { return this->edge().has_front_; }
    /// The value taken last; does not change until refresh().
    [[nodiscard]] const T& front() const noexcept {
      TACTUS_ASSERT(has_value());
      return this->edge().slots_[this->edge().front_];
    }
    /// Refreshes; null while nothing was ever published.
    [[nodiscard]] const T* latest() noexcept {
      refresh();
      return has_value() ? &front() : nullptr;
    }
  };

  /// Asserts when another producer (consumer) is alive. Any thread.
  Producer producer() noexcept { return Producer(*this, producer_latch_); }
  Consumer consumer() noexcept { return Consumer(*this, consumer_latch_); }

  /// For binding memory to each slot, before the first publication. Boot.
  [[nodiscard]] std::span<T, 3> slots_at_boot() noexcept {
    TACTUS_ASSERT(counter_.was().pushed == 0);
    return slots_;
  }

  [[nodiscard]] EdgeCounts was() const noexcept { return counter_.was(); }

 private:
  static constexpr std::uint8_t kFresh = 4;
  static constexpr std::uint8_t kIndexMask = 3;

  bool publish() noexcept {
    // Release pairs with refresh(): the slot's contents before its index. Acquire pairs with the release in
    // refresh(): the reader is done with the slot that we get back.
    const std::uint8_t old =
        middle_.exchange(static_cast<std::uint8_t>(back_ | kFresh), std::memory_order_acq_rel);
    back_ = old & kIndexMask;
    const bool was_read = (old & kFresh) == 0;
    counter_.count_pushed(1);
    if (!was_read) counter_.count_dropped();
    return was_read;
  }

  bool refresh() noexcept {
    // Relaxed: only decides whether to try. Once fresh it stays fresh until we take it, whatever the producer
    // does.
    if ((middle_.load(std::memory_order_relaxed) & kFresh) == 0) return false;
    // Acquire pairs with publish(): contents come with the index. Release pairs with the acquire in
    // publish(): our reads of the slot that we give back are over.
    front_ = middle_.exchange(front_, std::memory_order_acq_rel) & kIndexMask;
    has_front_ = true;
    return true;
  }

  alignas(kCacheLineBytes) typename Atomics::template Atomic<std::uint8_t> middle_{1};
  alignas(kCacheLineBytes) std::uint8_t back_ = 0;
  EdgeCounter counter_;
  EndLatch producer_latch_;
  alignas(kCacheLineBytes) std::uint8_t front_ = 2;
  bool has_front_ = false;
  EndLatch consumer_latch_;
  alignas(kCacheLineBytes) std::array<T, 3> slots_{};
};

}  // namespace tactus::rt
