// Brute force: every triple of points, every plane that has all of them on one side.
#include "pipeline/contact/hull.hpp"

#include <algorithm>
#include <optional>
#include <string>

namespace tactus::contact {
namespace {

constexpr std::size_t kFacesMax = ConvexHull::kFacesMax;
constexpr std::size_t kVerticesMax = ConvexHull::kVerticesMax;

/// Corners of one face, counter-clockwise from outside, as indices of the caller's points.
struct Face {
  Vec3d normal;
  double offset_m = 0;
  std::array<std::uint8_t, kVerticesMax> corners{};
  std::size_t corners_count = 0;
};

struct Faces {
  std::array<Face, kFacesMax> items;
  std::size_t count = 0;
};

/// Gift wrapping in the plane of the face; points between two corners are left out.
void wrap(std::span<const Vec3d> points, std::span<const std::uint8_t> coplanar, double tolerance_m,
          Face& face) {
  // Farthest from the first point: surely a corner, and so is whatever the wrapping finds.
  std::uint8_t start = coplanar[0];
  double farthest = -1;
  for (const std::uint8_t i : coplanar) {
    const Vec3d d = points[i] - points[coplanar[0]];
    if (d.dot(d) > farthest) {
      farthest = d.dot(d);
      start = i;
    }
  }
  std::uint8_t at = start;
  do {
    face.corners[face.corners_count++] = at;
    std::optional<std::uint8_t> next;
    for (const std::uint8_t i : coplanar) {
      if (i == at) continue;
      if (!next) {
        next = i;
        continue;
      }
      const Vec3d a = points[*next] - points[at];
      const Vec3d b = points[i] - points[at];
      const double right = b.cross(a).dot(face.normal);  // > 0: b turns further to the right than a
      const double even = tolerance_m * a.norm();
      if (right > even || (right > -even && b.dot(b) > a.dot(a))) next = i;
    }
    at = *next;
  } while (at != start && face.corners_count < std::min(coplanar.size(), face.corners.size()));
}

bool is_known(const Faces& faces, std::size_t i, std::size_t j, std::size_t k, std::span<const Vec3d> points,
              double tolerance_m) {
  for (std::size_t f = 0; f < faces.count; ++f) {
    const Face& face = faces.items[f];
    const auto on = [&](std::size_t p) { return face.normal.dot(points[p]) > face.offset_m - tolerance_m; };
    if (on(i) && on(j) && on(k)) return true;
  }
  return false;
}

/// False when there are more faces than a hull holds.
bool find_faces(std::span<const Vec3d> points, double size_m, double tolerance_m, Faces& faces) {
  faces.count = 0;
  for (std::size_t i = 0; i < points.size(); ++i)
    for (std::size_t j = i + 1; j < points.size(); ++j)
      for (std::size_t k = j + 1; k < points.size(); ++k) {
        Vec3d normal = (points[j] - points[i]).cross(points[k] - points[i]);
        if (normal.norm() < 10 * tolerance_m * size_m) continue;  // three points on a line
        normal = normal.normalized();
        const double offset_m = normal.dot(points[i]);
        double above_m = 0, below_m = 0;
        for (const Vec3d& p : points) {
          above_m = std::max(above_m, normal.dot(p) - offset_m);
          below_m = std::max(below_m, offset_m - normal.dot(p));
        }
        if (above_m > tolerance_m && below_m > tolerance_m) continue;
        if (is_known(faces, i, j, k, points, 2 * tolerance_m)) continue;
        if (faces.count == kFacesMax) return false;
        Face& face = faces.items[faces.count++];
        face = {};
        const double sign = above_m > tolerance_m ? -1 : 1;
        face.normal = normal * sign;
        face.offset_m = offset_m * sign;
        std::array<std::uint8_t, kHullPointsMax> coplanar;
        std::size_t count = 0;
        for (std::size_t p = 0; p < points.size(); ++p)
          if (face.normal.dot(points[p]) > face.offset_m - tolerance_m)
            coplanar[count++] = static_cast<std::uint8_t>(p);
        wrap(points, std::span(coplanar).first(count), tolerance_m, face);
      }
  return true;
}

/// Each edge belongs to two faces, once in either direction.
bool is_closed(const Faces& faces) {
  if (faces.count < 4) return false;
  std::array<std::array<std::uint8_t, kHullPointsMax>, kHullPointsMax> uses{};
  for (std::size_t f = 0; f < faces.count; ++f) {
    const Face& face = faces.items[f];
    if (face.corners_count < 3) return false;
    for (std::size_t c = 0; c < face.corners_count; ++c)
      ++uses[face.corners[c]][face.corners[(c + 1) % face.corners_count]];
  }
  for (std::size_t a = 0; a < kHullPointsMax; ++a)
    for (std::size_t b = 0; b < kHullPointsMax; ++b)
      if (uses[a][b] > 1 || uses[a][b] != uses[b][a]) return false;
  return true;
}

struct Moments {
  double volume_m3 = 0;
  Vec3d first;                     // integral of p
  std::array<double, 6> second{};  // of p p^T: xx yy zz xy xz yz
};

Moments integrate(std::span<const Vec3d> points, const Faces& faces) {
  Moments m;
  for (std::size_t f = 0; f < faces.count; ++f) {
    const Face& face = faces.items[f];
    const Vec3d a = points[face.corners[0]];
    for (std::size_t c = 1; c + 1 < face.corners_count; ++c) {
      const Vec3d b = points[face.corners[c]], d = points[face.corners[c + 1]];
      const double volume = a.dot(b.cross(d)) / 6;
      const Vec3d sum = a + b + d;
      m.volume_m3 += volume;
      m.first += sum * (volume / 4);
      const auto product = [&](auto&& x, auto&& y) {
        return volume / 20 * (x(a) * y(a) + x(b) * y(b) + x(d) * y(d) + x(sum) * y(sum));
      };
      const auto x = [](const Vec3d& v) { return v.x; };
      const auto y = [](const Vec3d& v) { return v.y; };
      const auto z = [](const Vec3d& v) { return v.z; };
      const std::array<double, 6> second = {product(x, x), product(y, y), product(z, z),
                                            product(x, y), product(x, z), product(y, z)};
      for (std::size_t i = 0; i < 6; ++i) m.second[i] += second[i];
    }
  }
  return m;
}

rt::Error refused(const std::string& why) { return {rt::ExitCode::bad_usage, "hull: " + why}; }

}  // namespace

rt::Result<ConvexHull> make_hull(std::span<const Vec3d> points, Vec3d* center_m) {
  if (points.size() < 4 || points.size() > kHullPointsMax)
    return refused(std::to_string(points.size()) + " points were given; between 4 and 64 make a hull");
  for (const Vec3d& p : points)
    if (!std::isfinite(p.x + p.y + p.z)) return refused("a point is not finite; give metres");

  // About a point of its own: coordinates far from the origin would cost digits.
  std::array<Vec3d, kHullPointsMax> local_m;
  double size_m = 0;
  for (const Vec3d& p : points) size_m = std::max(size_m, (p - points[0]).norm());
  std::size_t count = 0;
  for (const Vec3d& p : points) {
    const auto is_same = [&](const Vec3d& other) { return (p - points[0] - other).norm() <= 1e-6 * size_m; };
    if (std::none_of(local_m.begin(), local_m.begin() + static_cast<std::ptrdiff_t>(count), is_same))
      local_m[count++] = p - points[0];
  }
  const std::span<const Vec3d> local = std::span(local_m).first(count);

  // Points that are nearly in one plane belong to it at one of these shares of the size, or to no closed
  // hull.
  Faces faces;
  bool closed = false;
  for (const double share : {1e-10, 1e-8, 1e-6, 1e-4}) {
    if (find_faces(local, size_m, share * size_m, faces) && is_closed(faces)) {
      closed = true;
      break;
    }
  }
  Moments m;
  if (closed) m = integrate(local, faces);
  if (!closed || !(m.volume_m3 > 1e-7 * size_m * size_m * size_m))
    return refused(
        "the points lie in one plane, or more than 32 of them are corners; give fewer, spread in space");
  const Vec3d center = m.first * (1 / m.volume_m3);
  if (center_m != nullptr) *center_m = points[0] + center;

  ConvexHull hull;
  hull.volume_m3 = m.volume_m3;
  std::array<unsigned, kHullPointsMax> vertex_of;
  vertex_of.fill(kHullPointsMax);
  std::size_t written = 0;
  for (std::size_t f = 0; f < faces.count; ++f) {
    const Face& face = faces.items[f];
    hull.planes[f] = {face.normal.x, face.normal.y, face.normal.z, face.offset_m - face.normal.dot(center)};
    hull.polygons[written++] = static_cast<unsigned>(face.corners_count);
    for (std::size_t c = 0; c < face.corners_count; ++c) {
      const std::size_t corner = face.corners[c];
      if (vertex_of[corner] == kHullPointsMax) {
        if (hull.vertices_count == kVerticesMax)
          return refused("it has more than 32 corners; leave some points out");
        const Vec3d v = local[corner] - center;
        vertex_of[corner] = static_cast<unsigned>(hull.vertices_count);
        hull.vertices_m[hull.vertices_count++] = {v.x, v.y, v.z};
        hull.radius_m = std::max(hull.radius_m, v.norm());
      }
      hull.polygons[written++] = vertex_of[corner];
    }
  }
  hull.faces_count = faces.count;

  const double per_volume = 1 / m.volume_m3;
  const Vec3d& c = center;
  const std::array<double, 6> of_center = {c.x * c.x, c.y * c.y, c.z * c.z, c.x * c.y, c.x * c.z, c.y * c.z};
  std::array<double, 6> second;
  for (std::size_t i = 0; i < 6; ++i) second[i] = m.second[i] * per_volume - of_center[i];
  hull.inertia_m2 = {second[1] + second[2],
                     second[0] + second[2],
                     second[0] + second[1],
                     -second[3],
                     -second[4],
                     -second[5]};
  return hull;
}

}  // namespace tactus::contact
