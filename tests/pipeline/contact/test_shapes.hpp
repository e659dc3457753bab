// The five shapes for tests, each with poses that are at rest on a level floor.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "pipeline/contact/hull.hpp"
#include "pipeline/contact/world.hpp"

namespace tactus::test {

inline contact::ConvexHull hull_from(const std::vector<Vec3d>& points) {
  auto made = contact::make_hull(points);
  TACTUS_ASSERT(made.has_value());
  return made.value();
}

/// A prism of six sides that stands along z: like a nut.
inline const contact::ConvexHull& nut_hull() {
  static const contact::ConvexHull hull = [] {
    std::vector<Vec3d> points;
    for (int i = 0; i < 6; ++i)
      for (const double z : {-0.02, 0.02})
        points.push_back({0.04 * std::cos(i * contact::kPi / 3), 0.04 * std::sin(i * contact::kPi / 3), z});
    return hull_from(points);
  }();
  return hull;
}

/// Twelve random points in a ball of 4 cm.
inline const contact::ConvexHull& pebble_hull() {
  static const contact::ConvexHull hull = [] {
    std::mt19937 random(21);
    std::vector<Vec3d> points;
    while (points.size() < 12) {
      const auto unit = [&] { return static_cast<double>(random()) / 2147483648.0 - 1; };
      const Vec3d p{unit(), unit(), unit()};
      if (p.norm() < 1) points.push_back(p.normalized() * 0.04);
    }
    return hull_from(points);
  }();
  return hull;
}

inline constexpr Quaternion kZUp{0.70710678118654752, -0.70710678118654752, 0, 0};     // body z along world y
inline constexpr Quaternion kZAlongX{0.70710678118654752, 0, 0.70710678118654752, 0};  // body z along world x

/// A shape, how it lies, and the height of its centre over the floor then.
struct Lying {
  const char* name;
  contact::Shape shape;
  Quaternion q_world_body;
  double height_m;
  double half_width_m;  // along x
};

inline std::vector<Lying> lying_shapes() {
  using contact::Shape;
  return {{"sphere", Shape::sphere(0.04), {}, 0.04, 0.04},
          {"box", Shape::box({0.05, 0.03, 0.04}), {}, 0.03, 0.05},
          {"capsule", Shape::capsule(0.025, 0.04), kZAlongX, 0.025, 0.065},
          {"cylinder_upright", Shape::cylinder(0.035, 0.05), kZUp, 0.05, 0.035},
          {"cylinder_on_its_side", Shape::cylinder(0.035, 0.05), kZAlongX, 0.035, 0.05},
          {"wide_disc", Shape::cylinder(0.1, 0.015), kZUp, 0.015, 0.1},
          {"hull", Shape::convex(nut_hull()), kZUp, 0.02, 0.04}};
}

/// Of a test parameter that is an index of lying_shapes().
struct NameOfLying {
  template <typename ParamInfo>
  std::string operator()(const ParamInfo& info) const {
    return lying_shapes()[info.param].name;
  }
};

/// One of the five kinds, 2 to 8 cm across.
inline contact::Shape small_shape(int kind, std::mt19937& random) {
  using contact::Shape;
  const auto uniform = [&random](double a, double b) {
    return a + (b - a) * (static_cast<double>(random()) / 4294967296.0);
  };
  switch (kind % 5) {
    case 0:
      return Shape::sphere(uniform(0.01, 0.04));
    case 1:
      return Shape::box({uniform(0.01, 0.04), uniform(0.01, 0.04), uniform(0.01, 0.04)});
    case 2:
      return Shape::capsule(uniform(0.01, 0.02), uniform(0.01, 0.02));
    case 3:
      return Shape::cylinder(uniform(0.01, 0.04), uniform(0.01, 0.04));
    default:
      return Shape::convex(kind % 2 == 0 ? nut_hull() : pebble_hull());
  }
}

}  // namespace tactus::test
