// A hash table of a size fixed at boot, for one thread. (The labelled map has its own, with lock-free
// readers.)
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

#include "rt/assert.hpp"
#include "rt/slice.hpp"

namespace tactus::rt {

/// Mixes an integer of up to 64 bits so that every input bit reaches every output bit (Stafford's variant 13
/// of the MurmurHash3 finaliser, as in splitmix64; Steele et al. 2014). The same on every machine.
struct MixHash {
  template <typename Key>
  requires std::is_integral_v<Key> || std::is_enum_v<Key>
  constexpr std::uint64_t operator()(Key key) const {
    auto h = static_cast<std::uint64_t>(key);
    h = (h ^ (h >> 30)) * 0xbf58476d1ce4e5b9ULL;
    h = (h ^ (h >> 27)) * 0x94d049bb133111ebULL;
    return h ^ (h >> 31);
  }
};

/// Open addressing with linear probing; removal shifts back what follows, so there are no tombstones and no
/// slow decay. There are at least two slots per entry: a hit reads 1.5 slots on average and a miss 2.5 (Knuth
/// vol. 3, 6.4). Walking is in slot order, which depends only on the operations done: it repeats from run to
/// run. bind(): boot. The rest: any phase, one thread, no heap; bounded by probe_length_max() slots.
template <typename Key, typename Value, typename Hash = MixHash>
class FixedHash {
 public:
  struct Entry {
    Key key;
    Value value;
  };
  struct Inserted {
    Value* value = nullptr;  ///< where the key's value is; null when the table is full
    bool is_new = false;
  };

  static constexpr std::size_t slots_count_for(std::size_t count_max) { return std::bit_ceil(2 * count_max); }
  static constexpr std::size_t bytes_needed(std::size_t count_max) {
    return bytes_of<Entry>(slots_count_for(count_max)) + bytes_of<std::uint8_t>(slots_count_for(count_max));
  }
  void bind(Slice& memory, std::size_t count_max) {
    TACTUS_ASSERT(count_max > 0);
    count_max_ = count_max;
    entries_ = memory.take<Entry>(slots_count_for(count_max));
    used_ = memory.take<std::uint8_t>(slots_count_for(count_max));
  }

  [[nodiscard]] Value* find(const Key& key) noexcept {
    const std::size_t slot = slot_of(key);
    return used_[slot] != 0 ? &entries_[slot].value : nullptr;
  }
  [[nodiscard]] const Value* find(const Key& key) const noexcept {
    return const_cast<FixedHash*>(this)->find(key);
  }

  /// Leaves the value alone when the key is there already.
  [[nodiscard]] Inserted insert(const Key& key, const Value& value) noexcept {
    const std::size_t slot = slot_of(key);
    if (used_[slot] != 0) return {&entries_[slot].value, false};
    if (size_ == count_max_) return {};
    entries_[slot] = {key, value};
    used_[slot] = 1;
    ++size_;
    const std::size_t length = distance(home_of(key), slot) + 1;
    if (length > probe_length_max_) probe_length_max_ = length;
    return {&entries_[slot].value, true};
  }

  /// False when the key is not there.
  bool erase(const Key& key) noexcept {
    std::size_t hole = slot_of(key);
    if (used_[hole] == 0) return false;
    // Knuth vol. 3, 6.4, algorithm R: an entry may move into the hole unless its home lies after the hole.
    for (std::size_t slot = next(hole); used_[slot] != 0; slot = next(slot)) {
      if (distance(home_of(entries_[slot].key), slot) >= distance(hole, slot)) {
        entries_[hole] = entries_[slot];
        hole = slot;
      }
    }
    used_[hole] = 0;
    --size_;
    return true;
  }

  void clear() noexcept {
    for (std::uint8_t& used : used_) used = 0;
    size_ = 0;
  }

  template <typename Visit>
  void for_each(Visit&& visit) const {
    for (std::size_t slot = 0; slot < entries_.size(); ++slot) {
      if (used_[slot] != 0) visit(entries_[slot].key, entries_[slot].value);
    }
  }

  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] std::size_t count_max() const { return count_max_; }
  /// Slots that the longest insert so far looked at; 1 is perfect.
  [[nodiscard]] std::size_t probe_length_max() const { return probe_length_max_; }

 private:
  [[nodiscard]] std::size_t next(std::size_t slot) const { return (slot + 1) & (entries_.size() - 1); }
  [[nodiscard]] std::size_t distance(std::size_t from, std::size_t to) const {
    return (to - from) & (entries_.size() - 1);
  }
  [[nodiscard]] std::size_t home_of(const Key& key) const {
    return static_cast<std::size_t>(Hash()(key)) & (entries_.size() - 1);
  }
  // The key's slot, or the free one where it would go. Ends because half of the slots are always free.
  [[nodiscard]] std::size_t slot_of(const Key& key) const {
    std::size_t slot = home_of(key);
    while (used_[slot] != 0 && !(entries_[slot].key == key)) slot = next(slot);
    return slot;
  }

  std::span<Entry> entries_;
  std::span<std::uint8_t> used_;
  std::size_t count_max_ = 0;
  std::size_t size_ = 0;
  std::size_t probe_length_max_ = 0;
};

}  // namespace tactus::rt
