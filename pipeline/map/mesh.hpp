// The map's surface as triangles: marching cubes (Lorensen & Cline 1987) over all live blocks.
//
// A cube between eight voxel centres makes triangles when all eight were observed; it may reach into
// neighbour blocks. Vertices lie on cube edges and are made once, also across blocks, so that a closed
// surface is watertight. The case table is made at compile time from the geometry of the cube, see mesh.cpp.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "hal/transform.hpp"
#include "pipeline/label/material.hpp"
#include "pipeline/map/map.hpp"

namespace tactus::map {

struct MeshVertex {
  Vec3f position_world_m;
  Vec3f normal_world;  // unit, towards free space; the triangle's where the field is flat
  Rgb8 color;
  MaterialId label = kUnknownMaterial;  // most likely material of the cell
  float confidence = 0;                 // its probability; 0 when unknown
};

/// Indices of vertices, counter-clockwise seen from free space.
using MeshTriangle = std::array<std::uint32_t, 3>;

struct Mesh {
  std::vector<MeshVertex> vertices;
  std::vector<MeshTriangle> triangles;
};

struct MeshConfig {
  /// Voxels with less weight count as unobserved; 1 takes every measurement.
  std::uint8_t weight_min = 1;
  /// Only triangles that have most vertices of this material; kUnknownMaterial: all.
  MaterialId material_only = kUnknownMaterial;
};

/// Boot or exit phase: allocates (about 50 bytes a vertex). The writer's thread, or any while nobody writes.
/// The order of vertices and triangles depends on the map's content alone: blocks in key order, cubes x
/// fastest.
[[nodiscard]] Mesh extract_mesh(const Map& map, const MeshConfig& config = {});

}  // namespace tactus::map
