#include "pipeline/map/cell_list.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "pipeline/label/label_cell.hpp"
#include "pipeline/map/map.hpp"

namespace tactus::map {
namespace {

TEST(CellList, APointsCellIsThatOfItsNearestVoxel) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> place(-3.0f, 3.0f);
  for (int i = 0; i < 2000; ++i) {
    const Vec3f p{place(random), place(random), place(random)};
    const auto cell = [](float metres) {
      return static_cast<int>(std::floor(std::floor(metres * (1.0f / 0.01f) + 0.5f) / kCellSide));
    };
    EXPECT_EQ(grid_of(cell_at(p, 0.01f)), (Vec3<int>{cell(p.x), cell(p.y), cell(p.z)}))
        << p.x << " " << p.y << " " << p.z;
  }
}

TEST(CellList, AFlatSurfaceIsListedOnceWithItsPlaceColourAndLabel) {
  // A plane y = 3.2 voxels through two blocks beside each other, seen from above.
  MapConfig config;
  config.blocks_capacity = 256;
  alignas(64) static std::byte memory[std::size_t{1} << 21];
  ASSERT_LE(Map::bytes_needed(config), sizeof(memory));
  Map sut;
  sut.bind(rt::Slice(memory), config);
  const float height_m = 3.2f * config.voxel_size_m;
  BlockStaging staging{};
  std::array<LabelWord, kBlockCells> labels{};
  for (int z = 0; z < kBlockSide; ++z)
    for (int y = 0; y < kBlockSide; ++y)
      for (int x = 0; x < kBlockSide; ++x) {
        const float distance = (static_cast<float>(y) * config.voxel_size_m - height_m) / config.truncation_m;
        staging.tsdf[voxel_index(x, y, z)] =
            static_cast<std::int16_t>(std::clamp(distance, -1.0f, 1.0f) * kTsdfScale);
        staging.weight[voxel_index(x, y, z)] = 10;
        const int cell = cell_of_voxel(x, y, z);
        staging.color[cell] = {static_cast<std::uint8_t>(cell), 20, 30, 1};
        MaterialDistribution wood{};
        wood.fill(0.001f);
        wood[22] = 1;
        labels[static_cast<std::size_t>(cell)] = label::encode(wood, 1);
      }
  for (const int x : {1, 0}) {  // not in the order of their keys
    const BlockIndex block = sut.find_or_allocate(key_of({x, 0, 0}));
    ASSERT_NE(block, kNoBlock);
    sut.publish(block, staging);
    if (x == 0) sut.publish_labels(block, labels, 0);
  }

  std::vector<SurfaceCell> cells(count_surface_cells(sut));
  ASSERT_EQ(gather_surface_cells(sut, cells), cells.size());
  ASSERT_GE(cells.size(), 2u * 16)
      << "a layer of 4 x 4 cells in each block, and what else touches the surface";
  EXPECT_TRUE(std::is_sorted(cells.begin(), cells.end(),
                             [](const auto& a, const auto& b) { return a.address < b.address; }));
  std::size_t labelled_count = 0;
  for (const SurfaceCell& cell : cells) {
    EXPECT_NEAR(cell.position_world_m.y, height_m, 1e-4);
    EXPECT_NEAR(cell.normal_world.y, 1, 1e-4);
    EXPECT_EQ(cell.color.r, cell.address.cell);
    const Vec3<int> grid = grid_of(cell.address);
    EXPECT_NEAR(cell.position_world_m.x,
                (static_cast<float>(grid.x * kCellSide) + 0.5f) * config.voxel_size_m, 1e-5);
    EXPECT_EQ(label::best(cell.word), grid.x < kBlockCellSide ? 22 : kUnknownMaterial);
    labelled_count += cell.word != 0 ? 1u : 0u;
  }
  EXPECT_EQ(labelled_count * 2, cells.size());
}

}  // namespace
}  // namespace tactus::map
