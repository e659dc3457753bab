// The solids that rooms are made of, each with its exact signed distance and exact normal.
#pragma once

#include <cstdint>

#include "hal/transform.hpp"

namespace tactus::hal::synthetic {

/// Solids in their own frame, axis along y, centred on the origin. Dimensions a, b, c, r in metres:
enum class Shape : std::uint8_t {
  box,       ///< half extents a, b, c, edges rounded by r (inside the half extents); r = 0 is a sharp box
  sphere,    ///< radius a
  cylinder,  ///< radius a, half height b
  capsule,   ///< radius a, half length of the axis segment b
  torus,     ///< ring radius a, tube radius b
  frustum,   ///< bottom radius a, half height b, top radius c
  shell  ///< open wall of revolution: bottom radius a, half height b, top radius c, half thickness r, round
         ///< rims
};

struct Primitive {
  Shape shape = Shape::box;
  std::uint16_t finish = 0;  // index into Scene::finishes()
  std::uint16_t object = 0;  // index into Scene::object_names()
  double a = 0, b = 0, c = 0, r = 0;
  Vec3d center_world_m;
  Rotation R_local_world;
  Vec3d half_extents_m;  // bounding box in the local frame
  double bound_radius_m = 0;

  [[nodiscard]] Vec3d to_local(const Vec3d& p_world) const {
    return R_local_world * (p_world - center_world_m);
  }
};

/// Fills the bounds from shape and dimensions. Boot.
void update_bounds(Primitive& primitive);

/// Signed distance, negative inside; exact on both sides for every shape. p in the local frame, metres.
[[nodiscard]] double local_distance(const Primitive& primitive, const Vec3d& p);

/// Gradient of local_distance: unit, outward. Where the nearest point is not unique (edges' bisectors inside,
/// axes) one of the candidates is returned.
[[nodiscard]] Vec3d local_normal(const Primitive& primitive, const Vec3d& p);

}  // namespace tactus::hal::synthetic
