// The shapes of virtual bodies.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "hal/transform.hpp"

namespace tactus::contact {

enum class ShapeKind : std::uint8_t { sphere, box, capsule, cylinder, hull };

/// A convex polyhedron about its centre of mass, in the form that ODE reads. Made at boot (hull.hpp), never changed,
/// shared by all bodies of this shape and outlives them.
struct ConvexHull {
  static constexpr std::size_t kVerticesMax = 32, kFacesMax = 60;

  std::size_t vertices_count = 0, faces_count = 0;
  std::array<std::array<double, 3>, kVerticesMax> vertices_m{};
  /// One a face: outward unit normal and distance from the centre of mass.
  std::array<std::array<double, 4>, kFacesMax> planes{};
  /// One after the other: number of corners, then their vertices, counter-clockwise from outside. Each corner belongs to
  /// one edge of two faces: faces + 2 edges, at most 60 + 2 * 90.
  std::array<unsigned, kFacesMax + 2 * (kVerticesMax + kFacesMax - 2)> polygons{};
  double volume_m3 = 0;
  double radius_m = 0;                     // of the sphere about the centre that holds it
  std::array<double, 6> inertia_m2{};      // xx yy zz xy xz yz about the centre of mass, per kilogram

  [[nodiscard]] Vec3d vertex(std::size_t i) const { return {vertices_m[i][0], vertices_m[i][1], vertices_m[i][2]}; }
};

/// A body's shape in its own frame, centred on its centre of mass, metres. Capsule and cylinder stand along z.
struct Shape {
  ShapeKind kind = ShapeKind::sphere;
  double radius_m = 0.05;             // sphere, capsule, cylinder
  Vec3d half_extents_m;               // box
  double half_length_m = 0;           // cylinder; capsule: of its axis, without the caps
  const ConvexHull* hull = nullptr;   // hull

  static Shape sphere(double radius_m) { return {ShapeKind::sphere, radius_m, {}, 0, nullptr}; }
  static Shape box(const Vec3d& half_extents_m) { return {ShapeKind::box, 0, half_extents_m, 0, nullptr}; }
  static Shape capsule(double radius_m, double half_length_m) {
    return {ShapeKind::capsule, radius_m, {}, half_length_m, nullptr};
  }
  static Shape cylinder(double radius_m, double half_length_m) {
    return {ShapeKind::cylinder, radius_m, {}, half_length_m, nullptr};
  }
  static Shape convex(const ConvexHull& hull) { return {ShapeKind::hull, 0, {}, 0, &hull}; }
};

inline constexpr double kPi = 3.14159265358979323846;

inline double volume_m3(const Shape& shape) {
  const double r = shape.radius_m;
  switch (shape.kind) {
    case ShapeKind::sphere: return 4.0 / 3.0 * kPi * r * r * r;
    case ShapeKind::box: return 8 * shape.half_extents_m.x * shape.half_extents_m.y * shape.half_extents_m.z;
    case ShapeKind::capsule: return kPi * r * r * (2 * shape.half_length_m + 4.0 / 3.0 * r);
    case ShapeKind::cylinder: return kPi * r * r * 2 * shape.half_length_m;
    case ShapeKind::hull: return shape.hull->volume_m3;
  }
  return 0;
}

/// Radius of the sphere about the centre that holds the shape.
inline double reach_m(const Shape& shape) {
  switch (shape.kind) {
    case ShapeKind::sphere: return shape.radius_m;
    case ShapeKind::box: return shape.half_extents_m.norm();
    case ShapeKind::capsule: return shape.half_length_m + shape.radius_m;
    case ShapeKind::cylinder:
      return std::sqrt(shape.radius_m * shape.radius_m + shape.half_length_m * shape.half_length_m);
    case ShapeKind::hull: return shape.hull->radius_m;
  }
  return 0;
}

/// Radius of the largest sphere about the centre inside the shape.
inline double inner_radius_m(const Shape& shape) {
  switch (shape.kind) {
    case ShapeKind::sphere:
    case ShapeKind::capsule: return shape.radius_m;
    case ShapeKind::box: return std::min({shape.half_extents_m.x, shape.half_extents_m.y, shape.half_extents_m.z});
    case ShapeKind::cylinder: return std::min(shape.radius_m, shape.half_length_m);
    case ShapeKind::hull: break;
  }
  double least = shape.hull->radius_m;
  for (std::size_t i = 0; i < shape.hull->faces_count; ++i) least = std::min(least, shape.hull->planes[i][3]);
  return least;
}

}  // namespace tactus::contact
