// A small value with one writer and any number of readers, none of whom can hold up another.
//
// Design: a sequence lock over two copies (Linux calls it a latch), so that one copy is always whole.
//
//   sequence_ = s        copies_[s mod 2]       is value number s, complete, being read
//                        copies_[(s+1) mod 2]   is where the writer puts value s + 1, being written
//
//   write: words of copy (s+1) mod 2, then sequence_ = s + 1.
//   read:  s = sequence_; words of copy s mod 2; if sequence_ is still s, the words are value s. Else again.
//
// A plain sequence lock (one copy, odd while writing) makes readers spin for as long as the writer is
// preempted in the middle: a reader of higher priority on the same core would spin for ever. Here a reader
// goes again only if a whole new value was published while it read, so a stopped writer stops nobody. The
// price is a second copy of a small value.
//
// The words are atomics, so there is no data race in the language's sense (Boehm 2012, "Can seqlocks get
// along with programming language memory models?"). Boehm needs fences; acquire and release on the words do
// the same and can be checked by tools that do not understand fences:
// - sequence_.load(acquire) = s pairs with sequence_.store(release) = s: words of value s or later are seen.
// - A word read may be of value s + 2, the next one in the same copy. The writer stored it, with release,
//   after it stored sequence s + 1. Our acquire load of that word makes sequence s + 1 visible, so the second
//   look at sequence_ cannot answer s, and the value is thrown away. Without that acquire the second look
//   could be done early.
//
// Readers write nothing, so they do not slow each other or the writer. Writer: wait-free. Reader: lock-free,
// and bounded here by kReadAttemptsMax.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

#include "rt/atomics.hpp"
#include "rt/edge.hpp"
#include "rt/slice.hpp"

namespace tactus::rt {

/// For poses and other values up to a few cache lines. The writing end is acquired; readers just call read().
template <typename T, typename Atomics = StdAtomics>
class Seqlock {
  static_assert(std::is_trivially_copyable_v<T>);
  static_assert(sizeof(T) <= 4 * kCacheLineBytes, "a reader copies it all: for bigger states use a Mailbox");

 public:
  /// A copy takes tens of nanoseconds and a writer publishes every few hundred microseconds at most: a second
  /// attempt is rare, an eighth means that the reader was preempted eight times in a row.
  static constexpr int kReadAttemptsMax = 8;

  class Producer : public EdgeEnd<Seqlock> {
   public:
    using EdgeEnd<Seqlock>::EdgeEnd;
    /// Step, the writing thread, wait-free.
    void push(const T& value) noexcept { this->edge().write(value); }
  };

  /// Asserts when another producer is alive. Any thread.
  Producer producer() noexcept { return Producer(*this, producer_latch_); }

  /// False, and `value` unchanged, when nothing was published yet or the writer lapped us kReadAttemptsMax
  /// times. Step, any thread, bounded.
  [[nodiscard]] bool read(T& value) const noexcept {
    Words words;
    for (int attempt = 0; attempt < kReadAttemptsMax; ++attempt) {
      // Pairs with the release of sequence_ in write(): value s is complete.
      const std::uint64_t sequence = sequence_.load(std::memory_order_acquire);
      if (sequence == 0) return false;
      const Copy& copy = copies_[sequence % 2];
      // Acquire pairs with the release of the same word in write(): a newer word brings its sequence along.
      for (std::size_t i = 0; i < kWordsCount; ++i) words[i] = copy[i].load(std::memory_order_acquire);
      // Relaxed: cannot be done before the acquire loads above, nor answer less than they made visible.
      if (sequence_.load(std::memory_order_relaxed) != sequence) continue;
      std::memcpy(static_cast<void*>(&value), words.data(), sizeof(T));
      return true;
    }
    return false;
  }

  /// How many values were published. Nothing here knows who read them: dropped stays 0.
  [[nodiscard]] EdgeCounts was() const noexcept { return counter_.was(); }

 private:
  static constexpr std::size_t kWordsCount = (sizeof(T) + sizeof(std::uint64_t) - 1) / sizeof(std::uint64_t);
  using Words = std::array<std::uint64_t, kWordsCount>;
  using Copy = std::array<typename Atomics::template Atomic<std::uint64_t>, kWordsCount>;

  void write(const T& value) noexcept {
    Words words{};
    std::memcpy(words.data(), &value, sizeof(T));
    // Relaxed: our own variable, nobody else writes it.
    const std::uint64_t sequence = sequence_.load(std::memory_order_relaxed) + 1;
    Copy& copy = copies_[sequence % 2];
    // Release pairs with the acquire of the same word in read(): carries the sequence stored before.
    for (std::size_t i = 0; i < kWordsCount; ++i) copy[i].store(words[i], std::memory_order_release);
    // Pairs with the acquire of sequence_ in read(): the words come first.
    sequence_.store(sequence, std::memory_order_release);
    counter_.count_pushed(1);
  }

  alignas(kCacheLineBytes) typename Atomics::template Atomic<std::uint64_t> sequence_{0};
  std::array<Copy, 2> copies_{};
  alignas(kCacheLineBytes) EdgeCounter counter_;
  EndLatch producer_latch_;
};

}  // namespace tactus::rt
