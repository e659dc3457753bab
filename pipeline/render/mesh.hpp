// The triangle meshes of shapes that are not spheres: made once at boot, drawn by instances. No GL here.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "hal/transform.hpp"
#include "rt/status.hpp"

namespace tactus::render {

/// A convex polyhedron about its centre of mass, metres. Read at bind only.
struct HullMesh {
  std::span<const Vec3f> vertices_m;
  std::span<const std::array<std::uint16_t, 3>> triangles;  // either way round: the centre of mass is inside
};

/// An instance carries a vertex to half_axes * position + cap * half_length_m * (axis of z).
struct MeshVertex {
  Vec3f position;
  Vec3f normal;   // unit, for half axes of one length
  float cap = 0;  // -1, 1: which end of a capsule; 0: no capsule
};
static_assert(sizeof(MeshVertex) == 28);

/// Which mesh a number means; hull i is kFirstHullMesh + i.
inline constexpr std::size_t kBoxMesh = 0, kCylinderMesh = 1, kCapsuleMesh = 2, kFirstHullMesh = 3;
inline constexpr std::size_t kMeshesMax = 64;

struct MeshSet {
  struct Range {
    std::uint32_t first_index = 0, indices_count = 0;
  };
  std::vector<MeshVertex> vertices;
  std::vector<std::uint16_t> indices;
  std::vector<Range> ranges;
};

/// Box, cylinder and capsule of half size 1 (both along z; 32 sides: at 100 pixels of radius the outline is
/// 0.5 pixels off at most), then the hulls with flat normals. Boot. Errors: bad_usage (too many hulls or
/// vertices, an index without a vertex, a value that is not finite).
rt::Result<MeshSet> build_meshes(std::span<const HullMesh> hulls);

/// Radius of the sphere about the origin that holds the hull. Pure.
float radius_of(const HullMesh& hull);

}  // namespace tactus::render
