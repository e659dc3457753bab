#include "pipeline/map/block_hash.hpp"

#include "rt/assert.hpp"

// Fences are sound here because every access they order is atomic; the warning says that ThreadSanitizer
// ignores them.
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic ignored "-Wtsan"
#endif

namespace tactus::map {
namespace {
constexpr int kReadTries = 8;  // an erase moves a handful of entries: it is over long before
constexpr std::uint64_t kEmptySlot = kNoKey;
}  // namespace

void BlockHash::bind(rt::Slice& memory, std::size_t blocks_capacity) {
  const std::size_t count = slots_count(blocks_capacity);
  slots_ = memory.take<std::uint64_t>(count);
  for (auto& slot : slots_) slot = kEmptySlot;
  mask_ = static_cast<std::uint32_t>(count - 1);
  shift_ = 32 - std::countr_zero(count);
}

BlockIndex BlockHash::find_concurrent(BlockKey key) const noexcept {
  for (int attempt = 0; attempt < kReadTries; ++attempt) {
    // Pairs with the release store that ends an erase: what it moved is visible from here on.
    const std::uint32_t before = epoch_.load(std::memory_order_acquire);
    std::uint32_t slot = home(key);
    for (std::uint32_t probes = 0; probes <= mask_; ++probes, slot = (slot + 1) & mask_) {
      const std::uint64_t entry = load(slot);
      if (key_in(entry) == kNoKey) break;
      if (key_in(entry) == key) return index_in(entry);
    }
    // The slot loads above are acquire: this load cannot be moved before them, so an erase that began
    // meanwhile shows.
    if ((before & 1u) == 0 && epoch_.load(std::memory_order_relaxed) == before) return kNoBlock;
  }
  return kNoBlock;
}

void BlockHash::insert(BlockKey key, BlockIndex index) noexcept {
  TACTUS_ASSERT(2 * (entries_count_ + 1) <= slots_.size());
  std::uint32_t slot = home(key);
  while (key_in(slots_[slot]) != kNoKey) slot = (slot + 1) & mask_;
  store(slot, static_cast<std::uint64_t>(index) << 32 | key);
  ++entries_count_;
}

void BlockHash::erase(BlockKey key) noexcept {
  std::uint32_t hole = home(key);
  while (key_in(slots_[hole]) != key) {
    TACTUS_ASSERT(key_in(slots_[hole]) != kNoKey);
    hole = (hole + 1) & mask_;
  }
  const std::uint32_t epoch = epoch_.load(std::memory_order_relaxed);
  epoch_.store(epoch + 1, std::memory_order_relaxed);
  // Orders the odd epoch before the moves: a reader that saw a moved slot (acquire) then sees the odd epoch.
  std::atomic_thread_fence(std::memory_order_release);
  for (std::uint32_t next = (hole + 1) & mask_;; next = (next + 1) & mask_) {
    const std::uint64_t entry = slots_[next];
    if (key_in(entry) == kNoKey) break;
    // Move the entry into the hole if its home does not lie cyclically within (hole, next].
    const std::uint32_t from_home = (next - home(key_in(entry))) & mask_;
    const std::uint32_t from_hole = (next - hole) & mask_;
    if (from_home >= from_hole) {
      store(hole, entry);
      hole = next;
    }
  }
  store(hole, kEmptySlot);
  --entries_count_;
  epoch_.store(epoch + 2, std::memory_order_release);
}

}  // namespace tactus::map
