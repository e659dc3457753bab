#include "pipeline/map/map.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <vector>

#include "pipeline/profile.hpp"
#include "tests/pipeline/map/analytic_map.hpp"

namespace tactus::map {
namespace {

using test::OwnedMap;

BlockStaging stamped(std::int16_t value) {
  BlockStaging staging;
  std::fill_n(staging.tsdf, kBlockVoxels, value);
  std::fill_n(staging.weight, kBlockVoxels, std::uint8_t{7});
  std::fill_n(staging.color, kBlockCells, ColorCell{1, 2, 3, 4});
  return staging;
}

void expect_neighbours_as_searched(const Map& sut, const std::map<BlockKey, BlockIndex>& shadow) {
  for (const auto& [key, block] : shadow) {
    const BlockCoord c = coord_of(key);
    for (int m = 0; m < 8; ++m) {
      const auto other = shadow.find(key_of({c.x + (m & 1), c.y + (m >> 1 & 1), c.z + (m >> 2)}));
      ASSERT_EQ(sut.neighbours(block)[m], other == shadow.end() ? kNoBlock : other->second)
          << "block at " << c.x << ' ' << c.y << ' ' << c.z << " neighbour " << m;
    }
  }
}

TEST(Map, NeighbourTableEqualsABruteForceSearch) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    SCOPED_TRACE(seed);
    OwnedMap owned({0.01f, 0.04f, 200});
    Map& sut = owned.map;
    std::map<BlockKey, BlockIndex> shadow;
    std::mt19937_64 random(seed);
    for (int step = 0; step < 3000; ++step) {
      const auto at = [&](int low) { return low + static_cast<int>(random() % 6); };
      // Around the origin, and in the last corner of the extent, where some neighbours have no key.
      const BlockKey key =
          random() % 2 == 0 ? key_of({at(-3), at(-3), at(-3)}) : key_of({at(1018), at(505), at(1018)});
      if (const auto known = shadow.find(key); known != shadow.end()) {
        if (random() % 3 == 0) {
          sut.evict(known->second);
          shadow.erase(known);
        }
      } else {
        const BlockIndex block = sut.find_or_allocate(key);
        if (shadow.size() == 200) {
          ASSERT_EQ(block, kNoBlock);
        } else if (key != kNoKey) {
          ASSERT_NE(block, kNoBlock);
          shadow[key] = block;
        }
      }
      ASSERT_EQ(sut.blocks_used(), shadow.size());
      if (step % 50 == 0) expect_neighbours_as_searched(sut, shadow);
    }
    expect_neighbours_as_searched(sut, shadow);
    EXPECT_EQ(sut.counters().allocated - sut.counters().evicted, shadow.size());
  }
}

TEST(Map, FullPoolRefusesAndCounts) {
  OwnedMap owned({0.01f, 0.04f, 3});
  Map& sut = owned.map;
  for (int x = 0; x < 3; ++x) EXPECT_NE(sut.find_or_allocate(key_of({x, 0, 0})), kNoBlock);
  EXPECT_EQ(sut.find_or_allocate(key_of({3, 0, 0})), kNoBlock);
  EXPECT_EQ(sut.counters().refused, 1U);
  EXPECT_EQ(sut.blocks_free(), 0U);
  sut.evict(sut.find(key_of({1, 0, 0})));
  EXPECT_NE(sut.find_or_allocate(key_of({3, 0, 0})), kNoBlock);
  EXPECT_EQ(sut.find(key_of({1, 0, 0})), kNoBlock);
  EXPECT_EQ(sut.counters().used_high_water, 3U);
}

TEST(Map, BeyondTheExtentIsRefusedAndCounted) {
  OwnedMap owned({0.01f, 0.04f, 3});
  EXPECT_EQ(owned.map.find_or_allocate(key_of({0, 511, 0})), kNoBlock);
  EXPECT_EQ(owned.map.counters().out_of_extent, 1U);
  EXPECT_EQ(owned.map.blocks_used(), 0U);
}

TEST(Map, ReusedBlockIsUnknownEverywhere) {
  OwnedMap owned({0.01f, 0.04f, 1});
  Map& sut = owned.map;
  const BlockIndex block = sut.find_or_allocate(key_of({0, 0, 0}));
  sut.publish(block, stamped(1234));
  LabelWord words[kBlockCells];
  std::fill_n(words, kBlockCells, LabelWord{99});
  sut.publish_labels(block, words, 17);
  label::RefinedWord refined[kBlockCells];
  for (std::uint32_t c = 0; c < kBlockCells; ++c) refined[c] = 0x00ABCDEFU - c;
  sut.publish_refined(block, refined);
  BlockCopy copy;
  ASSERT_TRUE(sut.copy_concurrent(block, copy));
  EXPECT_EQ(copy.key, key_of({0, 0, 0}));
  EXPECT_EQ(copy.label_frame, 17U);
  for (int c = 0; c < kBlockCells; ++c) {
    ASSERT_EQ(copy.labels[c], 99U);
    ASSERT_EQ(copy.refined[c], refined[c]);
    ASSERT_EQ(sut.refined_concurrent(block, c), refined[c]);
  }
  EXPECT_EQ(copy.tsdf[77], sut.tsdf(block)[77]);
  sut.evict(block);
  EXPECT_FALSE(sut.copy_concurrent(block, copy));
  ASSERT_EQ(sut.find_or_allocate(key_of({5, 5, 5})), block);
  for (int v = 0; v < kBlockVoxels; ++v) {
    ASSERT_EQ(sut.tsdf(block)[v], kTsdfUnknown);
    ASSERT_EQ(sut.weight(block)[v], 0);
    ASSERT_EQ(sut.tsdf_concurrent(block, v), kTsdfUnknown);
  }
  for (int c = 0; c < kBlockCells; ++c) {
    ASSERT_EQ(sut.color(block)[c].weight, 0);
    ASSERT_EQ(sut.label_concurrent(block, c), 0U);
    ASSERT_EQ(sut.refined_concurrent(block, c), 0U);
  }
  EXPECT_EQ(sut.label_frame_concurrent(block), 0U);
}

TEST(Map, ConcurrentReadsSeeWhatWasPublished) {
  OwnedMap owned({0.01f, 0.04f, 2});
  Map& sut = owned.map;
  static_cast<void>(sut.find_or_allocate(key_of({9, 9, 9})));
  const BlockIndex block = sut.find_or_allocate(key_of({1, 2, 3}));
  BlockStaging staging;
  for (int v = 0; v < kBlockVoxels; ++v) {
    staging.tsdf[v] = static_cast<std::int16_t>(v * 61 - 16000);
    staging.weight[v] = static_cast<std::uint8_t>(v * 7);
  }
  for (int c = 0; c < kBlockCells; ++c)
    staging.color[c] = {static_cast<std::uint8_t>(c), static_cast<std::uint8_t>(2 * c),
                        static_cast<std::uint8_t>(255 - c), static_cast<std::uint8_t>(c & 7)};
  const std::uint32_t begun_before = sut.sequence_begin(block);
  sut.publish(block, staging);
  EXPECT_FALSE(sut.sequence_validate(block, begun_before));
  EXPECT_TRUE(sut.sequence_validate(block, sut.sequence_begin(block)));
  for (int v = 0; v < kBlockVoxels; ++v) {
    ASSERT_EQ(sut.tsdf_concurrent(block, v), staging.tsdf[v]);
    ASSERT_EQ(sut.weight_concurrent(block, v), staging.weight[v]);
  }
  for (int c = 0; c < kBlockCells; ++c) {
    const ColorCell color = sut.color_concurrent(block, c);
    ASSERT_EQ(color.r, staging.color[c].r);
    ASSERT_EQ(color.g, staging.color[c].g);
    ASSERT_EQ(color.b, staging.color[c].b);
    ASSERT_EQ(color.weight, staging.color[c].weight);
  }
}

TEST(Map, ContentHashIgnoresWhereBlocksLieInThePool) {
  const std::vector<BlockCoord> coords = {{0, 0, 0}, {1, 0, 0}, {-4, 2, 7}, {3, -3, 3}};
  const auto fill = [](Map& map, const BlockCoord& c) {
    map.publish(map.find_or_allocate(key_of(c)),
                stamped(static_cast<std::int16_t>(c.x * 100 + c.y * 10 + c.z)));
  };
  OwnedMap forward({0.01f, 0.04f, 8}), backward({0.01f, 0.04f, 8});
  for (const auto& c : coords) fill(forward.map, c);
  fill(backward.map, {7, 7, 7});
  for (auto c = coords.rbegin(); c != coords.rend(); ++c) fill(backward.map, *c);
  EXPECT_NE(forward.map.hash_content().geometry, backward.map.hash_content().geometry);
  backward.map.evict(backward.map.find(key_of({7, 7, 7})));
  EXPECT_EQ(forward.map.hash_content().geometry, backward.map.hash_content().geometry);
  LabelWord words[kBlockCells] = {};
  words[63] = 1;
  const auto before = forward.map.hash_content();
  forward.map.publish_labels(forward.map.find(key_of({1, 0, 0})), words, 1);
  EXPECT_EQ(forward.map.hash_content().geometry, before.geometry);
  EXPECT_NE(forward.map.hash_content().labels, before.labels);
}

// The CRF's three bytes a cell are not there yet, but their room is: 3 / 8 byte a voxel.
TEST(MapMemory, AtMostFiveBytesAVoxelInEveryProfile) {
  for (const MapConfig& config : {x86_profile().spine.map, headset_profile().spine.map}) {
    EXPECT_LE(Map::bytes_per_voxel(config), 5.0) << config.blocks_capacity << " blocks";
    EXPECT_GE(Map::bytes_per_voxel(config), 4.0);
  }
}

}  // namespace
}  // namespace tactus::map
