// The map's surface as a list of label cells: what a refinement over all of it, or a study, works on.
#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <span>

#include "hal/transform.hpp"
#include "pipeline/label/material.hpp"
#include "pipeline/label/refined_word.hpp"
#include "pipeline/map/block.hpp"

namespace tactus::map {

class Map;

/// Which cell of the world: its block and its number there.
struct CellAddress {
  BlockKey key = kNoKey;
  std::uint32_t cell = 0;
  friend constexpr auto operator<=>(const CellAddress&, const CellAddress&) = default;
};

/// The cell that answers for a point of the surface: the one of the nearest voxel, as map::Reader has it. Any
/// thread.
[[nodiscard]] CellAddress cell_at(const Vec3f& p_world_m, float voxel_size_m) noexcept;

/// The cell's place in the grid of cells over the world.
[[nodiscard]] Vec3<int> grid_of(const CellAddress& address) noexcept;

struct SurfaceCell {
  CellAddress address;
  Vec3f position_world_m;  // the surface point nearest to the cell's centre
  Vec3f normal_world;      // unit, towards free space
  Rgb8 color;
  LabelWord word = 0;              // 0: never labelled
  label::RefinedWord refined = 0;  // 0: never refined
};

/// How many there are; the map must rest. Any phase, no heap; looks at every voxel: some 10 ms.
[[nodiscard]] std::size_t count_surface_cells(const Map& map) noexcept;

/// Writes them in the order of their addresses and returns their number; `out` must have room for
/// count_surface_cells().
std::size_t gather_surface_cells(const Map& map, std::span<SurfaceCell> out) noexcept;

}  // namespace tactus::map
