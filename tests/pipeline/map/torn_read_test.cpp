// Readers beside a writer that publishes, evicts and reuses blocks as fast as it can.
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <chrono>
#include <random>
#include <thread>

#include "tests/pipeline/map/analytic_map.hpp"

namespace tactus::map {
namespace {

constexpr int kKeysCount = 24;  // twice the pool: blocks change their key all the time
constexpr std::uint32_t kCapacity = 12;
constexpr int kStampsPerKey = 1000;

BlockKey key_at(int i) { return key_of({i, -i, 2 * i}); }

struct Tally {
  std::uint64_t accepted = 0, stamped = 0, rejected = 0, mixed = 0, foreign = 0;
};

// As a reader of the map does it, but all 512 voxels at once: the widest window for a tear.
void read_block(const Map& map, int key_index, Tally& tally) {
  const BlockKey key = key_at(key_index);
  const BlockIndex block = map.find_concurrent(key);
  if (block == kNoBlock) return;
  const std::uint32_t begun = map.sequence_begin(block);
  std::array<std::int16_t, kBlockVoxels> tsdf;
  std::array<std::uint8_t, kBlockVoxels> weight;
  for (int v = 0; v < kBlockVoxels; ++v) {
    tsdf[static_cast<std::size_t>(v)] = map.tsdf_concurrent(block, v);
    weight[static_cast<std::size_t>(v)] = map.weight_concurrent(block, v);
  }
  const bool is_this_key = map.key_concurrent(block) == key;
  if (!map.sequence_validate(block, begun) || !is_this_key) {
    ++tally.rejected;
    return;
  }
  ++tally.accepted;
  const std::int16_t stamp = tsdf[0];
  for (std::size_t v = 0; v < kBlockVoxels; ++v)
    if (tsdf[v] != stamp || weight[v] != weight[0]) {
      ++tally.mixed;
      return;
    }
  if (stamp == kTsdfUnknown) {
    tally.mixed += weight[0] != 0;
    return;
  }
  ++tally.stamped;
  tally.foreign += stamp / kStampsPerKey != key_index;
  tally.mixed += weight[0] != static_cast<std::uint8_t>(stamp & 0xFF);
}

TEST(MapReaders, NoAcceptedCopyIsTornOrOfARecycledBlock) {
  test::OwnedMap owned({0.01f, 0.04f, kCapacity});
  Map& map = owned.map;
  std::atomic<bool> is_over{false};
  std::array<std::atomic<std::uint64_t>, 2> stamped{};
  std::array<Tally, 2> tallies;
  const auto read = [&](std::size_t reader) {
    std::mt19937_64 random(reader + 1);
    while (!is_over.load(std::memory_order_relaxed)) {
      read_block(map, static_cast<int>(random() % kKeysCount), tallies[reader]);
      stamped[reader].store(tallies[reader].stamped, std::memory_order_relaxed);
    }
  };
  std::thread first(read, std::size_t{0}), second(read, std::size_t{1});
  std::mt19937_64 random(3);
  BlockStaging staging{};
  std::atomic<int> pause{0};
  const auto begin = std::chrono::steady_clock::now();
  const auto seconds = [&] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  };
  std::uint64_t published = 0;
  // Long enough to have met the readers often, and never more than ten seconds.
  while (seconds() < 10 && (published < 50000 || stamped[0] < 2000 || stamped[1] < 2000)) {
    for (int i = 0; i < 100; ++i) {
      const int key_index = static_cast<int>(random() % kKeysCount);
      BlockIndex block = map.find(key_at(key_index));
      if (block != kNoBlock && random() % 8 == 0) {
        map.evict(block);
        continue;
      }
      if (block == kNoBlock) block = map.find_or_allocate(key_at(key_index));
      if (block == kNoBlock) continue;
      const auto stamp =
          static_cast<std::int16_t>(key_index * kStampsPerKey + static_cast<int>(random() % kStampsPerKey));
      std::fill_n(staging.tsdf, kBlockVoxels, stamp);
      std::fill_n(staging.weight, kBlockVoxels, static_cast<std::uint8_t>(stamp & 0xFF));
      map.publish(block, staging);
      ++published;
      const int spins = static_cast<int>(random() % 1000);
      for (int s = 0; s < spins; ++s) pause.store(s, std::memory_order_relaxed);
    }
  }
  is_over = true;
  first.join();
  second.join();
  for (const Tally& tally : tallies) {
    EXPECT_EQ(tally.mixed, 0U);
    EXPECT_EQ(tally.foreign, 0U);
    EXPECT_GT(tally.stamped, 100U);
  }
  EXPECT_GT(tallies[0].rejected + tallies[1].rejected, 0U)
      << "readers and writer never met: the test showed nothing";
}

}  // namespace
}  // namespace tactus::map
