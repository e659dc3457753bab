#include "hal/synthetic/primitive.hpp"

#include <algorithm>
#include <cmath>

namespace tactus::hal::synthetic {
namespace {

struct Vec2d {
  double x = 0, y = 0;  // radius from the axis, height
  [[nodiscard]] double squared() const { return x * x + y * y; }
};

double clamp01(double v) { return std::min(std::max(v, 0.0), 1.0); }
double sign_of(double v) { return v < 0 ? -1.0 : 1.0; }
double radius_of(const Vec3d& p) { return std::sqrt(p.x * p.x + p.z * p.z); }

/// Turns a gradient in the (radius, height) half-plane back to three dimensions.
Vec3d revolve(const Vec2d& gradient, const Vec3d& p) {
  const double radius = radius_of(p);
  if (radius < 1e-12) return {gradient.x, gradient.y, 0};
  return {gradient.x * p.x / radius, gradient.y, gradient.x * p.z / radius};
}

Vec2d unit(const Vec2d& v, const Vec2d& otherwise) {
  const double n = std::sqrt(v.squared());
  return n > 1e-9 ? Vec2d{v.x / n, v.y / n} : otherwise;
}

/// Vectors from the nearest point of cap and side to q, and the position along the side; after I. Quilez,
/// "distance to a capped cone".
struct FrustumFeet {
  Vec2d cap, side;
  double along = 0;
  [[nodiscard]] bool is_inside() const { return side.x < 0 && cap.y < 0; }
};

FrustumFeet frustum_feet(const Primitive& f, const Vec2d& q) {
  FrustumFeet feet;
  feet.cap = {q.x - std::min(q.x, q.y < 0 ? f.a : f.c), std::fabs(q.y) - f.b};
  const Vec2d up{f.c - f.a, 2 * f.b};
  feet.along = clamp01(((f.c - q.x) * up.x + (f.b - q.y) * up.y) / up.squared());
  feet.side = {q.x - f.c + up.x * feet.along, q.y - f.b + up.y * feet.along};
  return feet;
}

/// From the nearest point of the shell's wall segment to q.
Vec2d shell_foot(const Primitive& s, const Vec2d& q) {
  const Vec2d up{s.c - s.a, 2 * s.b};
  const double along = clamp01(((q.x - s.a) * up.x + (q.y + s.b) * up.y) / up.squared());
  return {q.x - s.a - up.x * along, q.y + s.b - up.y * along};
}

}  // namespace

void update_bounds(Primitive& p) {
  switch (p.shape) {
    case Shape::box:
      p.half_extents_m = {p.a, p.b, p.c};
      break;
    case Shape::sphere:
      p.half_extents_m = {p.a, p.a, p.a};
      break;
    case Shape::cylinder:
      p.half_extents_m = {p.a, p.b, p.a};
      break;
    case Shape::capsule:
      p.half_extents_m = {p.a, p.a + p.b, p.a};
      break;
    case Shape::torus:
      p.half_extents_m = {p.a + p.b, p.b, p.a + p.b};
      break;
    case Shape::frustum:
      p.half_extents_m = {std::max(p.a, p.c), p.b, std::max(p.a, p.c)};
      break;
    case Shape::shell:
      p.half_extents_m = {std::max(p.a, p.c) + p.r, p.b + p.r, std::max(p.a, p.c) + p.r};
      break;
  }
  p.bound_radius_m = p.shape == Shape::sphere ? p.a : p.half_extents_m.norm();
}

double local_distance(const Primitive& s, const Vec3d& p) {
  switch (s.shape) {
    case Shape::box: {
      const double qx = std::fabs(p.x) - (s.a - s.r), qy = std::fabs(p.y) - (s.b - s.r),
                   qz = std::fabs(p.z) - (s.c - s.r);
      const double inside = std::min(std::max(qx, std::max(qy, qz)), 0.0);
      const double ox = std::max(qx, 0.0), oy = std::max(qy, 0.0), oz = std::max(qz, 0.0);
      return std::sqrt(ox * ox + oy * oy + oz * oz) + inside - s.r;
    }
    case Shape::sphere:
      return p.norm() - s.a;
    case Shape::cylinder: {
      const double dx = radius_of(p) - s.a, dy = std::fabs(p.y) - s.b;
      const double ox = std::max(dx, 0.0), oy = std::max(dy, 0.0);
      return std::min(std::max(dx, dy), 0.0) + std::sqrt(ox * ox + oy * oy);
    }
    case Shape::capsule: {
      const double y = p.y - std::min(std::max(p.y, -s.b), s.b);
      return std::sqrt(p.x * p.x + y * y + p.z * p.z) - s.a;
    }
    case Shape::torus: {
      const double x = radius_of(p) - s.a;
      return std::sqrt(x * x + p.y * p.y) - s.b;
    }
    case Shape::frustum: {
      const FrustumFeet feet = frustum_feet(s, {radius_of(p), p.y});
      const double d = std::sqrt(std::min(feet.cap.squared(), feet.side.squared()));
      return feet.is_inside() ? -d : d;
    }
    case Shape::shell:
      return std::sqrt(shell_foot(s, {radius_of(p), p.y}).squared()) - s.r;
  }
  return 0;
}

Vec3d local_normal(const Primitive& s, const Vec3d& p) {
  switch (s.shape) {
    case Shape::box: {
      const Vec3d q{std::fabs(p.x) - (s.a - s.r), std::fabs(p.y) - (s.b - s.r), std::fabs(p.z) - (s.c - s.r)};
      const Vec3d outside{std::max(q.x, 0.0) * sign_of(p.x), std::max(q.y, 0.0) * sign_of(p.y),
                          std::max(q.z, 0.0) * sign_of(p.z)};
      const double n = outside.norm();
      if (n > 1e-9) return outside * (1 / n);
      if (q.x >= q.y && q.x >= q.z) return {sign_of(p.x), 0, 0};
      if (q.y >= q.z) return {0, sign_of(p.y), 0};
      return {0, 0, sign_of(p.z)};
    }
    case Shape::sphere: {
      const Vec3d n = p.normalized();
      return n == Vec3d{} ? Vec3d{0, 1, 0} : n;
    }
    case Shape::cylinder: {
      const double dx = radius_of(p) - s.a, dy = std::fabs(p.y) - s.b;
      const Vec2d face = dx >= dy ? Vec2d{1, 0} : Vec2d{0, 1};
      Vec2d g = unit({std::max(dx, 0.0), std::max(dy, 0.0)}, face);
      g.y = g.y * sign_of(p.y);
      return revolve(g, p);
    }
    case Shape::capsule: {
      const double y = p.y - std::min(std::max(p.y, -s.b), s.b);
      const Vec3d n = Vec3d{p.x, y, p.z}.normalized();
      return n == Vec3d{} ? Vec3d{1, 0, 0} : n;
    }
    case Shape::torus:
      return revolve(unit({radius_of(p) - s.a, p.y}, {1, 0}), p);
    case Shape::frustum: {
      const Vec2d q{radius_of(p), p.y};
      const FrustumFeet feet = frustum_feet(s, q);
      const double sign = feet.is_inside() ? -1.0 : 1.0;
      if (feet.cap.squared() < feet.side.squared()) {
        Vec2d g = unit({sign * feet.cap.x, sign * feet.cap.y}, {0, 1});
        g.y = g.y * sign_of(p.y);
        return revolve(g, p);
      }
      const Vec2d face = unit({2 * s.b, s.a - s.c}, {1, 0});
      if (feet.along > 0 && feet.along < 1) return revolve(face, p);
      return revolve(unit({sign * feet.side.x, sign * feet.side.y}, face), p);
    }
    case Shape::shell: {
      const Vec2d wall = unit({2 * s.b, s.a - s.c}, {1, 0});
      return revolve(unit(shell_foot(s, {radius_of(p), p.y}), wall), p);
    }
  }
  return {};
}

}  // namespace tactus::hal::synthetic
