// Which cells of a block hold a piece of surface, and where it lies.
#pragma once

#include <cstdint>

#include "hal/transform.hpp"
#include "pipeline/map/map.hpp"

namespace tactus::map {

/// A cell's piece of surface: the point nearest to the cell's centre, relative to the block's first voxel.
struct CellSurface {
  Vec3f foot_m;
  Vec3f normal_world;  // unit, towards free space
};

/// Bit c of the result: cell c has a voxel within a voxel size of the surface, or voxels on both sides of it.
/// tsdf: the 512 of a block. Phase: any. Pure.
[[nodiscard]] std::uint64_t cells_with_surface(const std::int16_t* tsdf, const MapConfig& config) noexcept;

/// Of a cell among cells_with_surface(); false when its field is flat. Unobserved voxels are left out. Phase:
/// any. Pure.
[[nodiscard]] bool surface_of_cell(const std::int16_t* tsdf, int cell, const MapConfig& config,
                                   CellSurface& out) noexcept;

}  // namespace tactus::map
