#include "pipeline/contact/hull.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <random>
#include <vector>

namespace tactus::contact {
namespace {

/// All points inside all planes, every corner on its face's plane, every edge once in either direction,
/// Euler's formula.
void expect_closed(const ConvexHull& hull, const std::vector<Vec3d>& points, const Vec3d& center) {
  std::map<std::pair<unsigned, unsigned>, int> edges;
  std::size_t at = 0;
  for (std::size_t f = 0; f < hull.faces_count; ++f) {
    const auto& plane = hull.planes[f];
    const Vec3d normal{plane[0], plane[1], plane[2]};
    EXPECT_NEAR(normal.norm(), 1, 1e-12);
    EXPECT_GT(plane[3], 0) << "the centre of mass is inside";
    for (const Vec3d& p : points) EXPECT_LE(normal.dot(p - center), plane[3] + 1e-9);
    const unsigned count = hull.polygons[at++];
    ASSERT_GE(count, 3U);
    for (unsigned c = 0; c < count; ++c) {
      const unsigned a = hull.polygons[at + c], b = hull.polygons[at + (c + 1) % count],
                     d = hull.polygons[at + (c + 2) % count];
      ASSERT_LT(a, hull.vertices_count);
      EXPECT_NEAR(normal.dot(hull.vertex(a)), plane[3], 1e-9);
      const Vec3d turn = (hull.vertex(b) - hull.vertex(a)).cross(hull.vertex(d) - hull.vertex(b));
      EXPECT_GT(turn.dot(normal), 0) << "counter-clockwise from outside";
      ++edges[{a, b}];
    }
    at += count;
  }
  for (const auto& [edge, uses] : edges) {
    EXPECT_EQ(uses, 1);
    EXPECT_TRUE(edges.contains({edge.second, edge.first}));
  }
  EXPECT_EQ(hull.vertices_count + hull.faces_count, edges.size() / 2 + 2);
}

ConvexHull hull_of(const std::vector<Vec3d>& points) {
  Vec3d center;
  const auto result = make_hull(points, &center);
  EXPECT_TRUE(result.has_value()) << (result ? "" : result.error().message);
  if (!result) return {};
  expect_closed(result.value(), points, center);
  return result.value();
}

std::vector<Vec3d> box_points(const Vec3d& half, const Vec3d& at) {
  std::vector<Vec3d> points;
  for (int i = 0; i < 8; ++i)
    points.push_back(at +
                     Vec3d{i & 1 ? half.x : -half.x, i & 2 ? half.y : -half.y, i & 4 ? half.z : -half.z});
  return points;
}

TEST(Hull, BoxHasSixFacesAndTheAnalyticMoments) {
  const Vec3d half{0.03, 0.05, 0.02}, at{1, -2, 3};
  std::vector<Vec3d> points = box_points(half, at);
  points.push_back(at);                             // inside
  points.push_back(at + Vec3d{half.x, 0, 0});       // inside a face
  points.push_back(at + Vec3d{half.x, half.y, 0});  // on an edge
  Vec3d center;
  const auto result = make_hull(points, &center);
  ASSERT_TRUE(result.has_value());
  const ConvexHull& hull = result.value();
  expect_closed(hull, points, center);
  EXPECT_EQ(hull.vertices_count, 8U);
  EXPECT_EQ(hull.faces_count, 6U);
  EXPECT_LT((center - at).norm(), 1e-12);
  EXPECT_NEAR(hull.volume_m3, 8 * half.x * half.y * half.z, 1e-15);
  EXPECT_NEAR(hull.radius_m, half.norm(), 1e-12);
  EXPECT_NEAR(hull.inertia_m2[0], (half.y * half.y + half.z * half.z) / 3, 1e-15);
  EXPECT_NEAR(hull.inertia_m2[1], (half.x * half.x + half.z * half.z) / 3, 1e-15);
  EXPECT_NEAR(hull.inertia_m2[2], (half.x * half.x + half.y * half.y) / 3, 1e-15);
  for (std::size_t i = 3; i < 6; ++i) EXPECT_NEAR(hull.inertia_m2[i], 0, 1e-15);
}

TEST(Hull, CornerTetrahedronHasTheAnalyticMoments) {
  const double a = 0.1;
  const ConvexHull hull = hull_of({{0, 0, 0}, {a, 0, 0}, {0, a, 0}, {0, 0, a}});
  EXPECT_EQ(hull.vertices_count, 4U);
  EXPECT_EQ(hull.faces_count, 4U);
  EXPECT_NEAR(hull.volume_m3, a * a * a / 6, 1e-15);
  // About the corner: 1/5 a^2 on the diagonal, -1/20 a^2 off it; moved to (a/4, a/4, a/4).
  EXPECT_NEAR(hull.inertia_m2[0], a * a * (0.2 - 0.125), 1e-15);
  EXPECT_NEAR(hull.inertia_m2[3], a * a * (-0.05 + 0.0625), 1e-15);
}

TEST(Hull, PrismOfSixteenSidesApproachesTheCylinder) {
  std::vector<Vec3d> points;
  const double r = 0.04, h = 0.06;
  const int n = 16;
  for (int i = 0; i < n; ++i)
    for (const double z : {-h, h})
      points.push_back({r * std::cos(2 * kPi * i / n), r * std::sin(2 * kPi * i / n), z});
  const ConvexHull hull = hull_of(points);
  EXPECT_EQ(hull.vertices_count, 32U);
  EXPECT_EQ(hull.faces_count, 18U);
  const double area = 0.5 * n * r * r * std::sin(2 * kPi / n);
  EXPECT_NEAR(hull.volume_m3, area * 2 * h, 1e-12);
  // Polar moment of a regular polygon per area: r^2 (2 + cos(2 pi / n)) / 6.
  const double polar = r * r * (2 + std::cos(2 * kPi / n)) / 6;
  EXPECT_NEAR(hull.inertia_m2[2], polar, 1e-12);
  EXPECT_NEAR(hull.inertia_m2[0], polar / 2 + h * h / 3, 1e-12);
}

TEST(Hull, RandomPointsLieInsideAllPlanesAndTheSurfaceIsClosed) {
  const unsigned seed = 5;
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int round = 0; round < 120; ++round) {
    std::vector<Vec3d> points;
    const int count = 4 + round % 28;
    const Vec3d at{unit(random), unit(random), unit(random)};
    const Vec3d size{0.05, 0.02 + 0.05 * (round % 3), round % 5 == 0 ? 0.002 : 0.04};
    for (int i = 0; i < count; ++i)
      points.push_back(at + Vec3d{unit(random) * size.x, unit(random) * size.y, unit(random) * size.z});
    hull_of(points);
  }
}

TEST(Hull, PointsOnALatticeMakeMergedFaces) {
  const unsigned seed = 9;
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  for (int round = 0; round < 60; ++round) {
    std::vector<Vec3d> points = {{0, 0, 0}, {0.03, 0, 0}, {0, 0.03, 0}, {0, 0, 0.03}};
    for (int i = 0; i < 20; ++i)
      points.push_back(Vec3d{static_cast<double>(random() % 4), static_cast<double>(random() % 4),
                             static_cast<double>(random() % 4)} *
                       0.01);
    hull_of(points);
  }
}

TEST(Hull, MomentsAgreeWithCountingPointsInside) {
  const unsigned seed = 12;
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<Vec3d> points;
  for (int i = 0; i < 14; ++i) points.push_back(Vec3d{unit(random), unit(random), unit(random)} * 0.05);
  const ConvexHull hull = hull_of(points);
  constexpr int kCells = 80;
  const double cell = 2 * hull.radius_m / kCells;
  double volume = 0, xx = 0, xy = 0;
  for (int i = 0; i < kCells; ++i)
    for (int j = 0; j < kCells; ++j)
      for (int k = 0; k < kCells; ++k) {
        const Vec3d p = Vec3d{i + 0.5 - kCells / 2, j + 0.5 - kCells / 2, k + 0.5 - kCells / 2} * cell;
        bool inside = true;
        for (std::size_t f = 0; f < hull.faces_count && inside; ++f)
          inside = p.dot({hull.planes[f][0], hull.planes[f][1], hull.planes[f][2]}) < hull.planes[f][3];
        if (!inside) continue;
        volume += 1;
        xx += p.y * p.y + p.z * p.z;
        xy -= p.x * p.y;
      }
  EXPECT_NEAR(hull.volume_m3, volume * cell * cell * cell, 0.01 * hull.volume_m3);
  EXPECT_NEAR(hull.inertia_m2[0], xx / volume, 0.01 * hull.inertia_m2[0]);
  EXPECT_NEAR(hull.inertia_m2[3], xy / volume, 0.01 * hull.inertia_m2[0]);
}

TEST(Hull, DegenerateInputIsOneSentence) {
  const std::vector<std::vector<Vec3d>> bad = {
      {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}},
      {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {0.5, 0.3, 0}},
      {{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {3, 3, 3}},
      {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}},
      {{0, 0, 0}, {1, 0, 0}, {0, NAN, 0}, {0, 0, 1}},
  };
  for (const auto& points : bad) {
    const auto result = make_hull(points);
    ASSERT_FALSE(result.has_value());
    EXPECT_EQ(result.error().code, rt::ExitCode::bad_usage);
    EXPECT_NE(result.error().message.find("hull: "), std::string::npos);
  }
}

TEST(Hull, MoreThanThirtyTwoCornersAreRefused) {
  std::vector<Vec3d> points;
  for (int i = 0; i < 40; ++i) {
    const double z = -1 + (i + 0.5) / 20, r = std::sqrt(1 - z * z);
    points.push_back({r * std::cos(2.4 * i), r * std::sin(2.4 * i), z});
  }
  const auto result = make_hull(points);
  ASSERT_FALSE(result.has_value());
  EXPECT_NE(result.error().message.find("32"), std::string::npos);
}

}  // namespace
}  // namespace tactus::contact
