#include "pipeline/evaluate/surface.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <string>

#include "tests/support/shared_data.hpp"

namespace tactus::evaluate {
namespace {

/// A square in the plane y = height with corners (+-half, +-half).
Mesh square(float half, float height) {
  Mesh m;
  m.vertices_m = {{-half, height, -half}, {half, height, -half}, {half, height, half}, {-half, height, half}};
  m.triangles = {{0, 1, 2}, {0, 2, 3}};
  return m;
}

Mesh random_mesh(std::mt19937& random, std::size_t triangles_count) {
  std::uniform_real_distribution<float> metres(-2, 2), edge(-0.2F, 0.2F);
  Mesh m;
  for (std::uint32_t i = 0; i < triangles_count; ++i) {
    const Vec3f a{metres(random), metres(random), metres(random)};
    m.vertices_m.insert(m.vertices_m.end(), {a, a + Vec3f{edge(random), edge(random), edge(random)},
                                             a + Vec3f{edge(random), edge(random), edge(random)}});
    m.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  return m;
}

/// Nearest point of a triangle by brute force over a fine barycentric grid: an oracle with an error below
/// `grid` edges.
double sampled_distance(const Vec3d& p, const Vec3d& a, const Vec3d& b, const Vec3d& c) {
  constexpr int kSteps = 200;
  double best = std::numeric_limits<double>::infinity();
  for (int i = 0; i <= kSteps; ++i)
    for (int j = 0; j <= kSteps - i; ++j)
      best = std::min(best, (p - (a + (b - a) * (1.0 * i / kSteps) + (c - a) * (1.0 * j / kSteps))).norm());
  return best;
}

TEST(TriangleDistance, HandComputedRegions) {
  const Vec3d a{0, 0, 0}, b{1, 0, 0}, c{0, 1, 0};
  EXPECT_DOUBLE_EQ(triangle_distance_squared({0.25, 0.25, 2}, a, b, c), 4);  // above the face
  EXPECT_DOUBLE_EQ(triangle_distance_squared({0.5, -3, 0}, a, b, c), 9);     // beside the edge ab
  EXPECT_DOUBLE_EQ(triangle_distance_squared({-3, -4, 0}, a, b, c), 25);     // before the corner a
  EXPECT_DOUBLE_EQ(triangle_distance_squared({1, 1, 0}, a, b, c), 0.5);      // beyond the hypotenuse
  EXPECT_DOUBLE_EQ(triangle_distance_squared({3, 0, 0}, a, b, c), 4);        // beyond the corner b
  EXPECT_DOUBLE_EQ(triangle_distance_squared({0.5, 1, 0}, a, b, a), 1);      // degenerate: a segment
  EXPECT_DOUBLE_EQ(triangle_distance_squared({0, 3, 4}, a, a, a), 25);       // degenerate: a point
}

TEST(TriangleDistance, AgreesWithSampling) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> metres(-1, 1);
  for (int round = 0; round < 50; ++round) {
    const auto point = [&] { return Vec3d{metres(random), metres(random), metres(random)}; };
    const Vec3d p = point(), a = point(), b = point(), c = point();
    const double sampled = sampled_distance(p, a, b, c);
    const double exact = std::sqrt(triangle_distance_squared(p, a, b, c));
    EXPECT_LE(exact, sampled + 1e-12);
    EXPECT_GE(exact, sampled - 0.02);
  }
}

TEST(MeshDistance, AgreesWithBruteForce) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> metres(-3, 3);
  for (const std::size_t count : {1u, 2u, 4u, 5u, 9u, 333u}) {
    const Mesh mesh = random_mesh(random, count);
    const MeshDistance sut(mesh);
    for (int q = 0; q < 100; ++q) {
      const Vec3d p{metres(random), metres(random), metres(random)};
      double best = std::numeric_limits<double>::infinity();
      for (const auto& t : mesh.triangles) {
        best = std::min(best, triangle_distance_squared(p, mesh.vertices_m[t[0]].cast<double>(),
                                                        mesh.vertices_m[t[1]].cast<double>(),
                                                        mesh.vertices_m[t[2]].cast<double>()));
      }
      EXPECT_DOUBLE_EQ(sut.nearest(p).distance_m, std::sqrt(best)) << count << " triangles";
    }
  }
}

TEST(MeshDistance, MeshWithoutFacesMeasuresToVertices) {
  Mesh cloud;
  cloud.vertices_m = {{0, 0, 0}, {1, 0, 0}, {5, 0, 0}};
  const MeshDistance sut(cloud);
  EXPECT_DOUBLE_EQ(sut.nearest({4, 0, 0}).distance_m, 1);
  EXPECT_EQ(sut.nearest({4, 0, 0}).primitive, 2u);
}

TEST(SampleSurface, IsEvenOverTheArea) {
  // Two squares, one of 9 times the area: 9 of 10 samples belong there; and within a square a quarter in each
  // quadrant.
  Mesh mesh = square(3, 0);
  const Mesh small = square(1, 10);
  for (const Vec3f& v : small.vertices_m) mesh.vertices_m.push_back(v);
  mesh.triangles.insert(mesh.triangles.end(), {{4, 5, 6}, {4, 6, 7}});
  const auto samples = sample_surface(mesh, 10'000);
  ASSERT_EQ(samples.size(), 10'000u);
  int large_count = 0, quadrant_count = 0;
  for (const SurfaceSample& s : samples) {
    if (s.position_m.y > 5) continue;
    ++large_count;
    quadrant_count += s.position_m.x > 0 && s.position_m.z > 0;
    EXPECT_LE(std::abs(s.position_m.x), 3.0F);
    EXPECT_LE(std::abs(s.position_m.z), 3.0F);
  }
  EXPECT_EQ(large_count, 9000);
  EXPECT_NEAR(quadrant_count, 2250, 30);
}

TEST(EvaluateSurface, ParallelPlanesAreTheirDistanceApart) {
  const Mesh truth = square(2, 0);
  const MeshDistance distance(truth);
  const auto report = evaluate_surface(sample_surface(square(1, 0.012F), 1000), {},
                                       [&](const Vec3d& p) { return distance.nearest(p).distance_m; });
  EXPECT_NEAR(report.distance_m.mean, 0.012, 1e-8);
  EXPECT_NEAR(report.distance_m.median, 0.012, 1e-8);
  EXPECT_NEAR(report.distance_m.rmse, 0.012, 1e-8);
  EXPECT_NEAR(report.distance_m.p95, 0.012, 1e-8);
  EXPECT_EQ(report.share_within_10mm, 0);
  EXPECT_EQ(report.share_within_20mm, 1);
}

TEST(EvaluateSurface, TiltedPlaneHasTheMeanOfALine) {
  // Height rises from 0 to 10 mm over the square: mean 5, rms 10/sqrt(3), p95 9.5 mm.
  Mesh tilted = square(1, 0);
  tilted.vertices_m[1].y = tilted.vertices_m[2].y = 0.010F;
  const auto report = evaluate_surface(sample_surface(tilted, 20'000), {},
                                       [](const Vec3d& p) { return -p.y; });  // sign is dropped
  EXPECT_NEAR(report.distance_m.mean, 0.005, 2e-5);
  EXPECT_NEAR(report.distance_m.rmse, 0.010 / std::sqrt(3.0), 2e-5);
  EXPECT_NEAR(report.distance_m.p95, 0.0095, 2e-5);
  EXPECT_NEAR(report.share_within_5mm, 0.5, 0.005);
}

TEST(EvaluateSurface, AlignmentIsAppliedToTheEstimate) {
  const MeshDistance distance(square(2, 0));
  const Alignment down{{}, {0, -0.5, 0}};
  const auto report = evaluate_surface(sample_surface(square(1, 0.5F), 100), down,
                                       [&](const Vec3d& p) { return distance.nearest(p).distance_m; });
  EXPECT_NEAR(report.distance_m.max, 0, 1e-7);
}

TEST(CompareLabels, CountsByTheNearestTrueTriangle) {
  Mesh truth = square(1, 0);
  truth.triangle_labels = {3, 22};  // triangle 0 is x > z
  Mesh estimate = square(1, 0.001F);
  estimate.vertex_labels = {3, 3, 3, 3};
  const MeshDistance distance(truth);
  const auto confusion = compare_labels(sample_surface(estimate, 1000), {}, truth, distance, 0.01);
  EXPECT_NEAR(static_cast<double>(confusion.count(3, 3)), 500, 2);
  EXPECT_NEAR(static_cast<double>(confusion.count(22, 3)), 500, 2);
  EXPECT_EQ(
      label_metrics(compare_labels(sample_surface(estimate, 1000), {}, truth, distance, 0.0001)).pixels_count,
      0u);
}

TEST(RecordedSurface, TrueMeshLiesOnItself) {
  const auto path = test::shared_data("bedroom_rendered/mesh.ply");
  if (!path) GTEST_SKIP() << "the recordings beside the project are absent";
  const auto mesh = read_ply(*path);
  ASSERT_TRUE(mesh.has_value()) << mesh.error().message;
  EXPECT_EQ(mesh->vertices_m.size(), 106859u);
  EXPECT_EQ(mesh->triangles.size(), 238382u);
  EXPECT_EQ(mesh->triangle_labels.size(), 238382u);
  const MeshDistance distance(*mesh);
  const auto samples = sample_surface(*mesh, 20'000);
  const auto report =
      evaluate_surface(samples, {}, [&](const Vec3d& p) { return distance.nearest(p).distance_m; });
  EXPECT_LT(report.distance_m.max, 1e-5);
  // Some panels of this mesh lie exactly on one another with different materials: the nearest is then either.
  EXPECT_GT(label_metrics(compare_labels(samples, {}, *mesh, distance, 0.01)).pixel_accuracy, 0.95);
}

}  // namespace
}  // namespace tactus::evaluate
