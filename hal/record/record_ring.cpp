#include "hal/record/record_ring.hpp"

#include "rt/assert.hpp"

namespace tactus::hal::record {
namespace {

constexpr std::uint64_t kSkip = ~std::uint64_t{0};

/// The word of the size, then the record.
std::uint64_t words_of(std::uint64_t bytes) { return 1 + (bytes + 7) / 8; }

}  // namespace

RecordRing::RecordRing(std::size_t bytes) : memory_((bytes + 7) / 8) { TACTUS_ASSERT(memory_.size() >= 4); }

std::span<std::uint8_t> RecordRing::reserve(std::size_t bytes) noexcept {
  // Relaxed: our own variable, nobody else writes it.
  const std::uint64_t tail = tail_.load(std::memory_order_relaxed), words = words_of(bytes), capacity = memory_.size();
  std::uint64_t at = tail % capacity;
  const std::uint64_t skipped = at + words > capacity ? capacity - at : 0;
  // Pairs with the release in pop(): the consumer is done with the memory before we overwrite it.
  const std::uint64_t head = head_.load(std::memory_order_acquire);
  if (tail + skipped + words - head > capacity) return {};
  if (skipped > 0) {
    memory_[at] = kSkip;
    at = 0;
  }
  memory_[at] = bytes;
  next_tail_ = tail + skipped + words;
  return {reinterpret_cast<std::uint8_t*>(&memory_[at] + 1), bytes};
}

void RecordRing::commit() noexcept {
  // Pairs with the acquire in front(): whoever sees the new tail sees the record.
  tail_.store(next_tail_, std::memory_order_release);
}

std::span<const std::uint8_t> RecordRing::front() noexcept {
  // Relaxed: our own variable, nobody else writes it.
  const std::uint64_t head = head_.load(std::memory_order_relaxed);
  // Pairs with the release in commit(): the record comes with the tail.
  if (head == tail_.load(std::memory_order_acquire)) return {};
  const std::uint64_t capacity = memory_.size();
  std::uint64_t at = head % capacity;
  const std::uint64_t skipped = memory_[at] == kSkip ? capacity - at : 0;
  if (skipped > 0) at = 0;
  next_head_ = head + skipped + words_of(memory_[at]);
  return {reinterpret_cast<const std::uint8_t*>(&memory_[at] + 1), static_cast<std::size_t>(memory_[at])};
}

void RecordRing::pop() noexcept {
  // Pairs with the acquire in reserve(): our reading is over before the producer may reuse the memory.
  head_.store(next_head_, std::memory_order_release);
}

}  // namespace tactus::hal::record
