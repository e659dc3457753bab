#include "pipeline/map/block.hpp"

#include <gtest/gtest.h>

#include <random>

namespace tactus::map {
namespace {

TEST(BlockKey, RoundTripsAtTheLimitsOfTheExtent) {
  for (const BlockCoord c :
       {BlockCoord{0, 0, 0}, BlockCoord{-1024, -512, -1024}, BlockCoord{1023, 510, 1023},
        BlockCoord{-1, -1, -1}, BlockCoord{1023, -512, -1024}, BlockCoord{-1024, 510, 1023}}) {
    ASSERT_NE(key_of(c), kNoKey);
    EXPECT_EQ(coord_of(key_of(c)), c);
  }
}

TEST(BlockKey, RoundTripsForRandomCoordinatesAndIsUnique) {
  const std::uint64_t seed = 20240611;
  RecordProperty("seed", static_cast<int>(seed));
  std::mt19937_64 random(seed);
  for (int i = 0; i < 100000; ++i) {
    const BlockCoord c{static_cast<int>(random() % 2048) - 1024, static_cast<int>(random() % 1023) - 512,
                       static_cast<int>(random() % 2048) - 1024};
    const BlockKey key = key_of(c);
    ASSERT_NE(key, kNoKey);
    ASSERT_EQ(coord_of(key), c) << "seed " << seed << " round " << i;
  }
}

TEST(BlockKey, OneBeyondTheExtentHasNoKey) {
  for (const BlockCoord c : {BlockCoord{-1025, 0, 0}, BlockCoord{1024, 0, 0}, BlockCoord{0, -513, 0},
                             BlockCoord{0, 511, 0}, BlockCoord{0, 0, -1025}, BlockCoord{0, 0, 1024},
                             BlockCoord{2048, 0, 0}, BlockCoord{0, 1024, 0}, BlockCoord{0, 0, 2048}})
    EXPECT_EQ(key_of(c), kNoKey) << c.x << ' ' << c.y << ' ' << c.z;
}

TEST(Voxel, FloorDivisionHoldsForNegativeCoordinates) {
  for (int v = -40; v <= 40; ++v) {
    EXPECT_EQ(block_of(v) * kBlockSide + in_block(v), v);
    EXPECT_GE(in_block(v), 0);
    EXPECT_LT(in_block(v), kBlockSide);
  }
}

TEST(Voxel, EachCellHoldsTwoByTwoByTwoVoxels) {
  int voxels_count[kBlockCells] = {};
  for (int z = 0; z < kBlockSide; ++z)
    for (int y = 0; y < kBlockSide; ++y)
      for (int x = 0; x < kBlockSide; ++x) ++voxels_count[cell_of_voxel(x, y, z)];
  for (const int count : voxels_count) EXPECT_EQ(count, 8);
  EXPECT_EQ(voxel_index(7, 7, 7), kBlockVoxels - 1);
}

}  // namespace
}  // namespace tactus::map
