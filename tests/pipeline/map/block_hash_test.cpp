// The hash against a std::map that is told the same, and against readers on other threads.
#include "pipeline/map/block_hash.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <map>
#include <memory>
#include <random>
#include <thread>
#include <vector>

namespace tactus::map {
namespace {

class OwnedHash {
 public:
  explicit OwnedHash(std::size_t blocks_capacity)
      : bytes_(rt::round_up(BlockHash::bytes_needed(blocks_capacity), 64)),
        memory_(static_cast<std::byte*>(std::aligned_alloc(64, bytes_)), &std::free) {
    rt::Slice slice({memory_.get(), bytes_});
    hash.bind(slice, blocks_capacity);
  }
  BlockHash hash;

 private:
  std::size_t bytes_;
  std::unique_ptr<std::byte, decltype(&std::free)> memory_;
};

// Keys of one hash slot or of its neighbours: long runs, so that erasing has entries to shift back.
std::vector<BlockKey> colliding_keys(const BlockHash& hash, std::size_t count, std::uint32_t slots_wide) {
  std::vector<BlockKey> keys;
  for (BlockKey key = 1; keys.size() < count; ++key)
    if (((key * BlockHash::kMultiplier) >> hash.shift()) < slots_wide) keys.push_back(key);
  return keys;
}

void play_against_shadow(std::uint64_t seed, std::size_t capacity, const std::vector<BlockKey>& keys,
                         BlockHash& sut) {
  std::mt19937_64 random(seed);
  std::map<BlockKey, BlockIndex> shadow;
  for (int step = 0; step < 4000; ++step) {
    const BlockKey key = keys[random() % keys.size()];
    const auto known = shadow.find(key);
    if (known != shadow.end() && random() % 2 == 0) {
      sut.erase(key);
      shadow.erase(known);
    } else if (known == shadow.end() && shadow.size() < capacity) {
      const auto index = static_cast<BlockIndex>(random() % 65535);
      sut.insert(key, index);
      shadow[key] = index;
    }
    ASSERT_EQ(sut.entries_count(), shadow.size());
    if (step % 16 != 0) continue;
    for (const BlockKey k : keys) {
      const auto entry = shadow.find(k);
      const BlockIndex expected = entry == shadow.end() ? kNoBlock : entry->second;
      ASSERT_EQ(sut.find(k), expected) << "seed " << seed << " step " << step << " key " << k;
      ASSERT_EQ(sut.find_concurrent(k), expected) << "seed " << seed << " step " << step << " key " << k;
    }
  }
}

TEST(BlockHash, EqualsAMapForRandomKeys) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE(seed);
    OwnedHash owned(100);
    std::mt19937_64 random(seed * 77);
    std::vector<BlockKey> keys(160);
    for (auto& key : keys) key = static_cast<BlockKey>(random()) & 0xFFFFFFFEu;
    play_against_shadow(seed, 100, keys, owned.hash);
  }
}

TEST(BlockHash, EqualsAMapWhenAllKeysCollide) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE(seed);
    OwnedHash owned(32);
    play_against_shadow(seed, 32, colliding_keys(owned.hash, 48, 3), owned.hash);
  }
}

TEST(BlockHash, EqualsAMapWhenRunsWrapAroundTheEnd) {
  OwnedHash owned(32);
  const auto last = owned.hash.mask();
  std::vector<BlockKey> keys;
  for (BlockKey key = 1; keys.size() < 40; ++key) {
    const std::uint32_t home = (key * BlockHash::kMultiplier) >> owned.hash.shift();
    if (home >= last - 1 || home == 0) keys.push_back(key);
  }
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    OwnedHash fresh(32);
    play_against_shadow(seed, 32, keys, fresh.hash);
  }
}

TEST(BlockHash, NoKeyIsNeverFound) {
  OwnedHash owned(4);
  EXPECT_EQ(owned.hash.find(kNoKey), kNoBlock);
  EXPECT_EQ(owned.hash.find_concurrent(kNoKey), kNoBlock);
}

TEST(BlockHash, ReadersAlwaysFindWhatIsNeverErased) {
  constexpr std::size_t kCapacity = 64;
  constexpr int kErasesCount = 300000;
  OwnedHash owned(kCapacity);
  BlockHash& sut = owned.hash;
  // All in a few runs: each erase shifts keys that stay.
  const std::vector<BlockKey> keys = colliding_keys(sut, kCapacity, 24);
  const auto index_of = [](std::size_t i) { return static_cast<BlockIndex>(1000 + i); };
  const auto stays = [](std::size_t i) { return i % 3 == 0; };
  std::mt19937_64 random(5);
  for (std::size_t i = keys.size(); i-- > 0;)
    if (stays(i)) sut.insert(keys[i], index_of(i));

  std::atomic<bool> is_over{false};
  std::atomic<std::uint64_t> misses{0}, wrong{0}, reads{0};
  const auto read = [&] {
    std::uint64_t count = 0;
    do {
      for (std::size_t i = 0; i < keys.size(); ++i) {
        const BlockIndex found = sut.find_concurrent(keys[i]);
        if (found == kNoBlock && stays(i)) ++misses;
        if (found != kNoBlock && found != index_of(i)) ++wrong;
      }
      count += keys.size();
    } while (!is_over.load(std::memory_order_relaxed));
    reads += count;
  };
  std::thread first(read), second(read);
  std::vector<bool> present(keys.size(), false);
  std::atomic<int> pause{0};
  for (int erases = 0; erases < kErasesCount;) {
    const std::size_t i = random() % keys.size();
    if (stays(i)) continue;
    if (present[i]) {
      sut.erase(keys[i]);
      ++erases;
    } else {
      sut.insert(keys[i], index_of(i));
    }
    present[i] = !present[i];
    // A map evicts a few blocks a frame, not back to back: a reader's eight tries must outlast a burst only.
    const int spins = static_cast<int>(random() % 60);
    for (int s = 0; s < spins; ++s) pause.store(s, std::memory_order_relaxed);
  }
  is_over = true;
  first.join();
  second.join();
  EXPECT_EQ(misses, 0U);
  EXPECT_EQ(wrong, 0U);
  EXPECT_GT(reads, 1000U);
}

}  // namespace
}  // namespace tactus::map
