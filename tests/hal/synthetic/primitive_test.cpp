#include "hal/synthetic/primitive.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace tactus::hal::synthetic {
namespace {

constexpr unsigned kSeed = 20240607;

Primitive make(Shape shape, double a, double b, double c, double r) {
  Primitive p;
  p.shape = shape;
  p.a = a;
  p.b = b;
  p.c = c;
  p.r = r;
  update_bounds(p);
  return p;
}

std::vector<Primitive> samples_of_every_shape() {
  return {make(Shape::box, 0.3, 0.2, 0.1, 0),        make(Shape::box, 0.3, 0.2, 0.1, 0.06),
          make(Shape::sphere, 0.25, 0, 0, 0),        make(Shape::cylinder, 0.15, 0.3, 0, 0),
          make(Shape::capsule, 0.1, 0.25, 0, 0),     make(Shape::torus, 0.25, 0.07, 0, 0),
          make(Shape::frustum, 0.2, 0.25, 0.1, 0),   make(Shape::frustum, 0.08, 0.05, 0.22, 0),
          make(Shape::shell, 0.2, 0.15, 0.12, 0.02), make(Shape::shell, 0.1, 0.2, 0.25, 0.015)};
}

Vec3d around_axis(double radius, double y, double angle) {
  return {radius * std::cos(angle), y, radius * std::sin(angle)};
}

/// Points of the surface made from the shape's description alone, never from its distance; at most `gap`
/// apart.
struct SurfaceSamples {
  std::vector<Vec3d> points;
  double gap_m;
};

/// A profile (radius, height) of the surface of revolution, swept round the axis.
void sweep(std::vector<Vec3d>& points, double radius, double y, double gap_m) {
  const int steps = std::max(1, static_cast<int>(2 * M_PI * radius / gap_m) + 1);
  for (int i = 0; i < steps; ++i) points.push_back(around_axis(radius, y, 2 * M_PI * i / steps));
}

void line(std::vector<Vec3d>& points, double r0, double y0, double r1, double y1, double gap_m) {
  const int steps = static_cast<int>(std::hypot(r1 - r0, y1 - y0) / gap_m) + 1;
  for (int i = 0; i <= steps; ++i)
    sweep(points, r0 + (r1 - r0) * i / steps, y0 + (y1 - y0) * i / steps, gap_m);
}

void arc(std::vector<Vec3d>& points, double r0, double y0, double radius, double gap_m) {
  const int steps = static_cast<int>(2 * M_PI * radius / gap_m) + 1;
  for (int i = 0; i < steps; ++i) {
    const double angle = 2 * M_PI * i / steps;
    const double r = r0 + radius * std::cos(angle);
    if (r >= 0) sweep(points, r, y0 + radius * std::sin(angle), gap_m);
  }
}

SurfaceSamples surface_of(const Primitive& s) {
  SurfaceSamples out{{}, 0.006};
  const double gap = out.gap_m;
  switch (s.shape) {
    case Shape::box: {
      // A rounded box is its shrunken core plus a ball: core surface points are pushed out along every
      // direction.
      const Vec3d core{s.a - s.r, s.b - s.r, s.c - s.r};
      const auto grid = [&](double half) {
        std::vector<double> values;
        const int n = static_cast<int>(2 * half / gap) + 1;
        for (int i = 0; i <= n; ++i) values.push_back(-half + 2 * half * i / n);
        return values;
      };
      for (const double side : {-1.0, 1.0}) {
        for (const double x : grid(core.x))
          for (const double y : grid(core.y)) out.points.push_back({x, y, side * s.c});
        for (const double x : grid(core.x))
          for (const double z : grid(core.z)) out.points.push_back({x, side * s.b, z});
        for (const double y : grid(core.y))
          for (const double z : grid(core.z)) out.points.push_back({side * s.a, y, z});
      }
      if (s.r > 0) {
        const int n = static_cast<int>(M_PI * s.r / gap) + 2;
        for (int i = 0; i <= n; ++i)
          for (int j = 0; j < 2 * n; ++j) {
            const double tilt = M_PI * i / n, turn = M_PI * j / n;
            const Vec3d u{std::sin(tilt) * std::cos(turn), std::cos(tilt), std::sin(tilt) * std::sin(turn)};
            const Vec3d corner{std::copysign(core.x, u.x), std::copysign(core.y, u.y),
                               std::copysign(core.z, u.z)};
            out.points.push_back(corner + u * s.r);
          }
        const int turns = static_cast<int>(2 * M_PI * s.r / gap) + 2;
        for (int j = 0; j < turns; ++j) {
          const double c = std::cos(2 * M_PI * j / turns), t = std::sin(2 * M_PI * j / turns);
          for (const double x : grid(core.x))
            out.points.push_back({x, std::copysign(core.y, c) + s.r * c, std::copysign(core.z, t) + s.r * t});
          for (const double y : grid(core.y))
            out.points.push_back({std::copysign(core.x, c) + s.r * c, y, std::copysign(core.z, t) + s.r * t});
          for (const double z : grid(core.z))
            out.points.push_back({std::copysign(core.x, c) + s.r * c, std::copysign(core.y, t) + s.r * t, z});
        }
      }
      break;
    }
    case Shape::sphere:
      arc(out.points, 0, 0, s.a, gap);
      break;
    case Shape::cylinder:
      line(out.points, s.a, -s.b, s.a, s.b, gap);
      line(out.points, 0, -s.b, s.a, -s.b, gap);
      line(out.points, 0, s.b, s.a, s.b, gap);
      break;
    case Shape::capsule: {
      line(out.points, s.a, -s.b, s.a, s.b, gap);
      std::vector<Vec3d> ball;
      arc(ball, 0, 0, s.a, gap);
      for (const Vec3d& p : ball) out.points.push_back(p + Vec3d{0, p.y < 0 ? -s.b : s.b, 0});
      break;
    }
    case Shape::torus:
      arc(out.points, s.a, 0, s.b, gap);
      break;
    case Shape::frustum:
      line(out.points, s.a, -s.b, s.c, s.b, gap);
      line(out.points, 0, -s.b, s.a, -s.b, gap);
      line(out.points, 0, s.b, s.c, s.b, gap);
      break;
    case Shape::shell: {
      const double length = std::hypot(s.c - s.a, 2 * s.b);
      const double nr = 2 * s.b / length * s.r, ny = (s.a - s.c) / length * s.r;
      line(out.points, s.a + nr, -s.b + ny, s.c + nr, s.b + ny, gap);
      line(out.points, s.a - nr, -s.b - ny, s.c - nr, s.b - ny, gap);
      // Of the rims' circles only the outward halves are surface.
      for (const double end : {-1.0, 1.0}) {
        const double r0 = end < 0 ? s.a : s.c, y0 = end * s.b;
        const double tr = end * (s.c - s.a) / length, ty = end * 2 * s.b / length;
        const int steps = static_cast<int>(2 * M_PI * s.r / gap) + 8;
        for (int i = 0; i < steps; ++i) {
          const double c = std::cos(2 * M_PI * i / steps), t = std::sin(2 * M_PI * i / steps);
          if (c * tr + t * ty >= 0) sweep(out.points, r0 + s.r * c, y0 + s.r * t, gap);
        }
      }
      break;
    }
  }
  return out;
}

TEST(Primitive, DistanceEqualsNearestOfTheSurfacesPoints) {
  std::mt19937 random(kSeed);
  for (const Primitive& sut : samples_of_every_shape()) {
    SCOPED_TRACE(testing::Message() << "shape " << static_cast<int>(sut.shape) << " r " << sut.r << " seed "
                                    << kSeed);
    const SurfaceSamples surface = surface_of(sut);
    std::uniform_real_distribution<double> x(-0.6, 0.6);
    for (int i = 0; i < 100; ++i) {
      const Vec3d p{x(random), x(random), x(random)};
      const double d = local_distance(sut, p);
      double nearest = 1e9;
      for (const Vec3d& q : surface.points) nearest = std::min(nearest, (p - q).dot(p - q));
      nearest = std::sqrt(nearest);
      // Never farther than a point of the surface; nearer by no more than the samples are apart.
      EXPECT_LE(std::fabs(d), nearest + 1e-9) << p.x << " " << p.y << " " << p.z;
      EXPECT_GE(std::fabs(d), nearest - surface.gap_m) << p.x << " " << p.y << " " << p.z;
    }
  }
}

TEST(Primitive, SurfacePointsHaveZeroDistance) {
  for (const Primitive& sut : samples_of_every_shape()) {
    double worst = 0;
    for (const Vec3d& q : surface_of(sut).points) worst = std::max(worst, std::fabs(local_distance(sut, q)));
    EXPECT_LT(worst, 1e-12) << "shape " << static_cast<int>(sut.shape) << " r " << sut.r;
  }
}

TEST(Primitive, CentersOfMaterialAreInside) {
  EXPECT_LT(local_distance(make(Shape::box, 0.3, 0.2, 0.1, 0), {0.29, 0, 0}), 0);
  EXPECT_LT(local_distance(make(Shape::cylinder, 0.15, 0.3, 0, 0), {0, 0.29, 0}), 0);
  EXPECT_LT(local_distance(make(Shape::torus, 0.25, 0.07, 0, 0), {0.25, 0, 0}), 0);
  EXPECT_GT(local_distance(make(Shape::torus, 0.25, 0.07, 0, 0), {0, 0, 0}), 0);
  EXPECT_LT(local_distance(make(Shape::frustum, 0.2, 0.25, 0.1, 0), {0, 0.24, 0}), 0);
  EXPECT_GT(local_distance(make(Shape::shell, 0.2, 0.15, 0.12, 0.02), {0, 0, 0}), 0);
  EXPECT_LT(local_distance(make(Shape::shell, 0.2, 0.15, 0.12, 0.02), {0.16, 0, 0}), 0);
}

TEST(Primitive, NormalIsTheGradientAndOfUnitLength) {
  std::mt19937 random(kSeed);
  constexpr double kStep_m = 1e-6;
  for (const Primitive& sut : samples_of_every_shape()) {
    SCOPED_TRACE(testing::Message() << "shape " << static_cast<int>(sut.shape) << " r " << sut.r << " seed "
                                    << kSeed);
    std::uniform_real_distribution<double> x(-0.6, 0.6);
    int checked = 0;
    for (int i = 0; i < 4000; ++i) {
      Vec3d p{x(random), x(random), x(random)};
      const Vec3d n0 = local_normal(sut, p);
      EXPECT_NEAR(n0.norm(), 1, 1e-9);
      // Half of the points are brought to the surface, where tracking and shading ask.
      if (i % 2 == 0) p = p - n0 * local_distance(sut, p) + n0 * 2e-4;
      const auto slope = [&](const Vec3d& step) {
        return (local_distance(sut, p + step) - local_distance(sut, p - step)) / (2 * kStep_m);
      };
      const Vec3d g{slope({kStep_m, 0, 0}), slope({0, kStep_m, 0}), slope({0, 0, kStep_m})};
      // Where the field has a crease (the medial axis, inside or in the open middle of a ring) no gradient
      // exists.
      if (std::fabs(g.norm() - 1) > 1e-4) continue;
      ++checked;
      // Differences reach over an edge's kink by 1e-6 of 2e-4 m.
      EXPECT_LT((g - local_normal(sut, p)).norm(), 5e-3) << p.x << " " << p.y << " " << p.z;
    }
    EXPECT_GT(checked, 3900);
  }
}

TEST(Primitive, DistanceNeverChangesFasterThanThePoint) {
  std::mt19937 random(kSeed);
  std::uniform_real_distribution<double> x(-0.6, 0.6);
  for (const Primitive& sut : samples_of_every_shape())
    for (int i = 0; i < 2000; ++i) {
      const Vec3d p{x(random), x(random), x(random)}, q{x(random), x(random), x(random)};
      EXPECT_LE(std::fabs(local_distance(sut, p) - local_distance(sut, q)), (p - q).norm() + 1e-12);
    }
}

}  // namespace
}  // namespace tactus::hal::synthetic
