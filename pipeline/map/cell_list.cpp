#include "pipeline/map/cell_list.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "pipeline/map/map.hpp"
#include "pipeline/map/surface_cells.hpp"
#include "rt/assert.hpp"

namespace tactus::map {
namespace {

/// visit(block, cell, surface) for every cell that holds a piece of surface.
template <typename Visit>
void for_each_surface_cell(const Map& map, const Visit& visit) {
  for (std::uint32_t i = 0; i < map.config().blocks_capacity; ++i) {
    const auto block = static_cast<BlockIndex>(i);
    if (map.key(block) == kNoKey) continue;
    const std::int16_t* tsdf = map.tsdf(block);
    for (std::uint64_t left = cells_with_surface(tsdf, map.config()); left != 0; left &= left - 1) {
      const int cell = std::countr_zero(left);
      CellSurface surface;
      if (surface_of_cell(tsdf, cell, map.config(), surface)) visit(block, cell, surface);
    }
  }
}

}  // namespace

CellAddress cell_at(const Vec3f& p_world_m, float voxel_size_m) noexcept {
  const Vec3f lattice = p_world_m * (1.0f / voxel_size_m);
  const int i = static_cast<int>(std::floor(lattice.x + 0.5f)),
            j = static_cast<int>(std::floor(lattice.y + 0.5f)),
            k = static_cast<int>(std::floor(lattice.z + 0.5f));
  return {key_of({block_of(i), block_of(j), block_of(k)}),
          static_cast<std::uint32_t>(cell_of_voxel(in_block(i), in_block(j), in_block(k)))};
}

Vec3<int> grid_of(const CellAddress& address) noexcept {
  const BlockCoord c = coord_of(address.key);
  const auto cell = static_cast<int>(address.cell);
  return {c.x * kBlockCellSide + (cell & 3), c.y * kBlockCellSide + (cell >> 2 & 3),
          c.z * kBlockCellSide + (cell >> 4)};
}

std::size_t count_surface_cells(const Map& map) noexcept {
  std::size_t count = 0;
  for_each_surface_cell(map, [&](BlockIndex, int, const CellSurface&) { ++count; });
  return count;
}

std::size_t gather_surface_cells(const Map& map, std::span<SurfaceCell> out) noexcept {
  std::size_t count = 0;
  const float block_m = kBlockSide * map.config().voxel_size_m;
  for_each_surface_cell(map, [&](BlockIndex block, int cell, const CellSurface& surface) {
    TACTUS_ASSERT(count < out.size());
    const BlockKey key = map.key(block);
    const BlockCoord c = coord_of(key);
    const Vec3f origin =
        Vec3f{static_cast<float>(c.x), static_cast<float>(c.y), static_cast<float>(c.z)} * block_m;
    const auto index = static_cast<std::size_t>(cell);
    const ColorCell& color = map.color(block)[index];
    out[count++] = {{key, static_cast<std::uint32_t>(cell)},
                    origin + surface.foot_m,
                    surface.normal_world,
                    {color.r, color.g, color.b},
                    map.labels(block)[index],
                    map.refined_concurrent(block, cell)};
  });
  std::sort(out.begin(), out.begin() + static_cast<std::ptrdiff_t>(count),
            [](const SurfaceCell& a, const SurfaceCell& b) { return a.address < b.address; });
  return count;
}

}  // namespace tactus::map
