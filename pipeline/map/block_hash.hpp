// Fixed open-addressing hash from block key to pool index: one writer, any number of readers without a lock.
//
// A slot is one 64-bit word (index << 32 | key), so that a reader never sees half an entry. The writer
// inserts with a single store. Erasing shifts later entries of the run back (no tombstones: a map that evicts
// for hours keeps its probe length), and while entries move a reader that probes past the gap may miss one.
// Therefore `epoch_` is odd while entries move; a reader trusts a *miss* only if the epoch was even and the
// same before and after. A *hit* needs no epoch: the caller checks the block's own sequence counter and key
// (pipeline/map/map.hpp).
//
// Load is kept <= 1/2 by construction (slots >= 2 x blocks): linear probing then needs 1.5 probes for a hit
// and 2.5 for a miss on average (Knuth, TAOCP 3, 6.4).
#pragma once

#include <atomic>
#include <bit>
#include <cstdint>
#include <span>

#include "pipeline/map/block.hpp"
#include "rt/slice.hpp"

namespace tactus::map {

class BlockHash {
 public:
  static constexpr std::size_t slots_count(std::size_t blocks_capacity) {
    return std::bit_ceil(2 * blocks_capacity);
  }
  static constexpr std::size_t bytes_needed(std::size_t blocks_capacity) {
    return rt::bytes_of<std::uint64_t>(slots_count(blocks_capacity));
  }

  /// Boot.
  void bind(rt::Slice& memory, std::size_t blocks_capacity);

  /// Writer only. kNoBlock when absent.
  [[nodiscard]] BlockIndex find(BlockKey key) const noexcept {
    for (std::uint32_t slot = home(key);; slot = (slot + 1) & mask_) {
      const std::uint64_t entry = slots_[slot];
      if (key_in(entry) == kNoKey) return kNoBlock;  // first: so that kNoKey itself is never found
      if (key_in(entry) == key) return index_in(entry);
    }
  }

  /// Any thread, lock-free. kNoBlock when absent, or when the writer kept moving entries during all tries.
  [[nodiscard]] BlockIndex find_concurrent(BlockKey key) const noexcept;

  /// Writer only; the key must be absent and there must be room.
  void insert(BlockKey key, BlockIndex index) noexcept;
  /// Writer only; the key must be present.
  void erase(BlockKey key) noexcept;

  [[nodiscard]] std::size_t entries_count() const noexcept { return entries_count_; }

  /// For vector kernels of the writer: slots as pairs of 32-bit words {key, index}.
  [[nodiscard]] const std::uint32_t* words() const noexcept {
    return reinterpret_cast<const std::uint32_t*>(slots_.data());
  }
  [[nodiscard]] std::uint32_t mask() const noexcept { return mask_; }
  [[nodiscard]] int shift() const noexcept { return shift_; }
  static constexpr std::uint32_t kMultiplier =
      2654435769u;  // 2^32 / golden ratio (Knuth's multiplicative hashing)

 private:
  static_assert(std::endian::native == std::endian::little, "words() relies on the key being the first half");
  static constexpr BlockKey key_in(std::uint64_t entry) { return static_cast<BlockKey>(entry); }
  static constexpr BlockIndex index_in(std::uint64_t entry) { return static_cast<BlockIndex>(entry >> 32); }
  [[nodiscard]] std::uint32_t home(BlockKey key) const noexcept { return (key * kMultiplier) >> shift_; }
  [[nodiscard]] std::uint64_t load(std::uint32_t slot) const noexcept {
    // Pairs with the release store of store(): a reader that sees an entry sees the block behind it
    // initialised.
    return std::atomic_ref(const_cast<std::uint64_t&>(slots_[slot])).load(std::memory_order_acquire);
  }
  void store(std::uint32_t slot, std::uint64_t entry) noexcept {
    std::atomic_ref(slots_[slot]).store(entry, std::memory_order_release);
  }

  std::span<std::uint64_t> slots_;
  std::uint32_t mask_ = 0;
  int shift_ = 0;
  std::size_t entries_count_ = 0;
  std::atomic<std::uint32_t> epoch_{0};
};

}  // namespace tactus::map
