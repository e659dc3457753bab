#include "pipeline/contact/surface_points.hpp"

#include <algorithm>

#include "pipeline/contact/directions.hpp"

namespace tactus::contact {
namespace {

/// Pieces of a length so that none is wider than the spacing; 4 at most.
int pieces_of(double length_m, double spacing_m) {
  int n = 1;
  while (n < 4 && length_m > spacing_m * n) ++n;
  return n;
}

void box_points(const Vec3d& half, double spacing_m, SurfacePoints& out) {
  const int nx = pieces_of(2 * half.x, spacing_m), ny = pieces_of(2 * half.y, spacing_m),
            nz = pieces_of(2 * half.z, spacing_m);
  for (int i = 0; i <= nx; ++i)
    for (int j = 0; j <= ny; ++j)
      for (int k = 0; k <= nz; ++k) {
        if (i != 0 && i != nx && j != 0 && j != ny && k != 0 && k != nz) continue;
        out.add({half.x * (2.0 * i / nx - 1), half.y * (2.0 * j / ny - 1), half.z * (2.0 * k / nz - 1)});
      }
}

/// 8 directions of a rim, 16 where they would lie wider apart than the spacing.
std::size_t rim_stride(double radius_m, double spacing_m) { return 0.785 * radius_m > spacing_m ? 1 : 2; }

void ring(double radius_m, double z_m, std::size_t stride, SurfacePoints& out) {
  for (std::size_t i = 0; i < kCircleDirections.size(); i += stride)
    out.add(kCircleDirections[i] * radius_m + Vec3d{0, 0, z_m});
}

void cylinder_points(double radius_m, double half_length_m, double spacing_m, SurfacePoints& out) {
  const std::size_t stride = rim_stride(radius_m, spacing_m);
  const int along = pieces_of(2 * half_length_m, spacing_m);
  const int across = pieces_of(radius_m, spacing_m);
  // The rims twice as dense: what stands half over a table's edge stands on them.
  const std::size_t rim = rim_stride(radius_m, 0.5 * spacing_m);
  for (const double z_m : {-half_length_m, half_length_m}) ring(radius_m, z_m, rim, out);
  for (int i = 1; i < along; ++i) ring(radius_m, half_length_m * (2.0 * i / along - 1), stride, out);
  for (const double z_m : {-half_length_m, half_length_m}) {
    for (int k = 1; k < across; ++k) ring(radius_m * k / across, z_m, stride, out);
    out.add({0, 0, z_m});
  }
  out.sag_m = (stride == 1 ? 0.0193 : 0.0762) * radius_m;  // 1 - cos of half the angle between two
}

void capsule_points(double radius_m, double half_length_m, double spacing_m, SurfacePoints& out) {
  const std::size_t stride = rim_stride(radius_m, spacing_m);
  const int along = pieces_of(2 * half_length_m, spacing_m);
  for (const double side : {-1.0, 1.0}) {
    ring(radius_m, side * half_length_m, stride, out);
    for (const Vec3d& d : kBallDirections)
      if (d.z > 0) out.add({d.x * radius_m, d.y * radius_m, side * (half_length_m + d.z * radius_m)});
  }
  for (int i = 1; i < along; ++i) ring(radius_m, half_length_m * (2.0 * i / along - 1), stride, out);
  out.sag_m = 0.113 * radius_m;  // 1 - cos(27.4 degrees)
}

void hull_points(const ConvexHull& hull, double spacing_m, SurfacePoints& out) {
  for (std::size_t i = 0; i < hull.vertices_count; ++i) out.add(hull.vertex(i));
  // Inside an edge, once: from its lower corner; inside a face, in the fan from its first corner.
  const auto for_each_face = [&](auto&& visit) {
    const unsigned* at = hull.polygons.data();
    for (std::size_t f = 0; f < hull.faces_count; ++f) {
      visit(at + 1, *at);
      at += *at + 1;
    }
  };
  for_each_face([&](const unsigned* corners, unsigned count) {
    for (unsigned c = 0; c < count; ++c) {
      const unsigned a = corners[c], b = corners[(c + 1) % count];
      if (a > b) continue;
      const Vec3d from = hull.vertex(a), way = hull.vertex(b) - from;
      const int n = pieces_of(way.norm(), spacing_m);
      for (int i = 1; i < n; ++i) out.add(from + way * (static_cast<double>(i) / n));
    }
  });
  for_each_face([&](const unsigned* corners, unsigned count) {
    const Vec3d a = hull.vertex(corners[0]);
    for (unsigned c = 1; c + 1 < count; ++c) {
      const Vec3d b = hull.vertex(corners[c]) - a, d = hull.vertex(corners[c + 1]) - a;
      const int n = pieces_of(std::max({b.norm(), d.norm(), (d - b).norm()}), spacing_m);
      for (int i = 1; i < n; ++i)
        for (int j = c > 1 ? 0 : 1; i + j < n; ++j)
          out.add(a + b * (static_cast<double>(i) / n) + d * (static_cast<double>(j) / n));
    }
  });
}

/// The direction across the axis nearest to `down`, of the radius' length; `p_m`'s own where down runs along
/// the axis (3 degrees: there the rim is level) or belongs to another point of the rim.
Vec3d around(const Vec3d& p_m, const Vec3d& down, double radius_m) {
  const double across2 = down.x * down.x + down.y * down.y;
  if (across2 < 0.05 * 0.05) return p_m;
  const double scale = radius_m / std::sqrt(across2);
  const Vec3d turned{down.x * scale, down.y * scale, p_m.z};
  const double cosine = (turned.x * p_m.x + turned.y * p_m.y) / (radius_m * radius_m);
  return cosine > 0.91 ? turned : p_m;  // 22.5 degrees and a little
}

}  // namespace

void surface_points(const Shape& shape, double spacing_m, SurfacePoints& out) noexcept {
  out.count = 0;
  out.sag_m = 0;
  switch (shape.kind) {
    case ShapeKind::sphere:
      break;
    case ShapeKind::box:
      box_points(shape.half_extents_m, spacing_m, out);
      break;
    case ShapeKind::capsule:
      capsule_points(shape.radius_m, shape.half_length_m, spacing_m, out);
      break;
    case ShapeKind::cylinder:
      cylinder_points(shape.radius_m, shape.half_length_m, spacing_m, out);
      break;
    case ShapeKind::hull:
      hull_points(*shape.hull, spacing_m, out);
      break;
  }
}

void surface_distances(const DistanceField& field, const SurfacePoints& surface, const Vec3d& center,
                       const Rotation& R_world_body,
                       std::span<float, SurfacePoints::kMax> distances_m) noexcept {
  std::array<Vec3f, SurfacePoints::kMax> points;
  for (std::size_t i = 0; i < surface.count; ++i)
    points[i] = (center + R_world_body * surface.points_m[i]).cast<float>();
  field.distances(std::span(points).first(surface.count), distances_m);
}

Vec3d deepest_beside(const Shape& shape, const Vec3d& p_m, const Vec3d& down) noexcept {
  const double r = shape.radius_m;
  if (shape.kind == ShapeKind::cylinder) {
    const bool on_rim = p_m.x * p_m.x + p_m.y * p_m.y > 0.99 * r * r;
    return on_rim ? around(p_m, down, r) : p_m;
  }
  if (shape.kind != ShapeKind::capsule) return p_m;
  const double h = shape.half_length_m;
  const bool on_cap = std::abs(p_m.z) >= h && down.z * p_m.z > 0;
  if (!on_cap) return std::abs(p_m.z) <= h ? around(p_m, down, r) : p_m;
  const Vec3d from{p_m.x, p_m.y, p_m.z > 0 ? p_m.z - h : p_m.z + h};
  if (from.dot(down) < 0.88 * r) return p_m;  // 27.4 degrees and a little
  return down * r + Vec3d{0, 0, p_m.z > 0 ? h : -h};
}

}  // namespace tactus::contact
