// Where in a block there is surface, and the piece of it that a 2x2x2 cell holds.
#pragma once

#include <cstdint>

#include "hal/transform.hpp"
#include "pipeline/map/map.hpp"

namespace tactus::map {

/// A cell's piece of surface: the point nearest to the cell's centre, relative to the block's first voxel.
struct CellSurface {
  Vec3f foot_m;
  Vec3f normal_world;
};

/// Bit c of the result: cell c has a voxel within a voxel size of the surface, or voxels on both sides of it.
/// `tsdf`: the 512 values of a block. Any phase; no heap.
[[nodiscard]] std::uint64_t cells_with_surface(const std::int16_t* tsdf, const MapConfig& config) noexcept;

/// Of a cell among cells_with_surface(); false when its field is flat. Unobserved voxels are left out. Any
/// phase; no heap.
[[nodiscard]] bool surface_of_cell(const std::int16_t* tsdf, int cell, const MapConfig& config,
                                   CellSurface& out) noexcept;

}  // namespace tactus::map
