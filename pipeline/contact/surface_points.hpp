// The points of a shape's surface that are tested against a distance field.
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "pipeline/contact/distance_field.hpp"
#include "pipeline/contact/shape.hpp"

namespace tactus::contact {

/// In the body frame, metres.
struct SurfacePoints {
  static constexpr std::size_t kMax = 192;

  std::array<Vec3d, kMax> points_m;
  std::size_t count = 0;
  /// How much farther out than the nearest of its points a curved surface can reach, metres; 0 for flat ones.
  double sag_m = 0;

  void add(const Vec3d& p_m) {
    if (count < kMax) points_m[count++] = p_m;
  }
};

/// Points no wider apart than `spacing_m`, at most 5 along an edge or axis, on boxes, capsules, cylinders and
/// hulls (no points for a sphere: field_contacts.hpp descends on it). Corners come before edges and edges
/// before faces; a round rim has 8 points, 16 when it is wide. Step phase; wait-free.
void surface_points(const Shape& shape, double spacing_m, SurfacePoints& out) noexcept;

/// What `field` measures at each of the points of a body that stands there. Step phase; wait-free.
void surface_distances(const DistanceField& field, const SurfacePoints& surface, const Vec3d& center_world_m,
                       const Rotation& R_world_body,
                       std::span<float, SurfacePoints::kMax> distances_m) noexcept;

/// The point of the rim, round side or cap that `p_m` stands for which lies farthest along `down` (unit, body
/// frame), so that what is round rolls like a round thing; `p_m` itself on flat parts and where the neighbour
/// is the one to ask. Step phase; wait-free.
Vec3d deepest_beside(const Shape& shape, const Vec3d& p_m, const Vec3d& down) noexcept;

}  // namespace tactus::contact
