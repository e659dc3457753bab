// The shapes of virtual bodies.
#pragma once

#include <cstdint>

#include "hal/transform.hpp"

namespace tactus::contact {

enum class ShapeKind : std::uint8_t { sphere, box };

/// A body's shape in its own frame, centred on its centre of mass, metres.
struct Shape {
  ShapeKind kind = ShapeKind::sphere;
  double radius_m = 0.05;  // sphere
  Vec3d half_extents_m;    // box

  static Shape sphere(double radius_m) { return {ShapeKind::sphere, radius_m, {}}; }
  static Shape box(const Vec3d& half_extents_m) { return {ShapeKind::box, 0, half_extents_m}; }
};

inline constexpr double kPi = 3.14159265358979323846;

inline double volume_m3(const Shape& shape) {
  if (shape.kind == ShapeKind::sphere)
    return 4.0 / 3.0 * kPi * shape.radius_m * shape.radius_m * shape.radius_m;
  return 8 * shape.half_extents_m.x * shape.half_extents_m.y * shape.half_extents_m.z;
}

}  // namespace tactus::contact
