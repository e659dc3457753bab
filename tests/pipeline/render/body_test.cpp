#include "pipeline/render/body.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>

namespace tactus::render {
namespace {

hal::Intrinsics test_camera() {
  hal::Intrinsics camera;
  camera.width = 160;
  camera.height = 120;
  camera.fx = camera.fy = 130;
  camera.cx = 79.5;
  camera.cy = 59.5;
  return camera;
}

Body sphere(Vec3d center, float radius_m) {
  return {Shape::sphere, {1, 2, 3}, {radius_m, radius_m, radius_m}, center, {}};
}
Body box(Vec3d center, Vec3f half_m, Quaternion rotation = {}) {
  return {Shape::box, {4, 5, 6}, half_m, center, rotation};
}

struct Built {
  InstanceCounts counts;
  std::array<SphereInstance, 8> spheres;
  std::array<MeshInstance, 8> meshes;
  std::array<Caster, 16> casters;
};

Built build(std::span<const Body> bodies, const T_WorldDepth& T_world_depth = {}) {
  Built built;
  constexpr std::array<float, 2> kHullRadiiM = {0.2F, 0.3F};
  built.counts = build_instances(bodies, T_world_depth, test_camera(), {}, kHullRadiiM, built.spheres,
                                 built.meshes, built.casters);
  return built;
}

TEST(TangentSlopes, RandomSpheresAreTouchedByBothLines) {
  constexpr unsigned kSeed = 7;
  SCOPED_TRACE(kSeed);
  std::mt19937 random(kSeed);
  std::uniform_real_distribution<double> lateral(-3, 3), part(0.02, 0.95), distance(0.2, 8);
  for (int i = 0; i < 1000; ++i) {
    const double x = lateral(random), z = distance(random), r = part(random) * z;
    const auto slopes = tangent_slopes(x, z, r);
    EXPECT_LT(slopes[0], slopes[1]);
    // Distance of the centre from the line (m, 1) t is |x - m z| / sqrt(1 + m^2).
    for (const double m : slopes)
      EXPECT_NEAR(std::fabs(x - m * z) / std::sqrt(1 + m * m), r, 1e-9 * (1 + std::fabs(x) + z));
  }
}

TEST(BuildInstances, SphereRectangleHoldsEveryPointOfTheSphere) {
  constexpr unsigned kSeed = 11;
  SCOPED_TRACE(kSeed);
  std::mt19937 random(kSeed);
  std::normal_distribution<double> normal;
  const hal::Intrinsics camera = test_camera();
  const Vec3d center{0.31, -0.22, 1.4};
  constexpr double kRadius = 0.25;
  const std::array<Body, 1> bodies = {sphere(center, static_cast<float>(kRadius))};
  const Built sut = build(bodies);
  ASSERT_EQ(sut.counts.spheres.in_view_count, 1U);
  const auto& rectangle = sut.spheres[0].rectangle_ndc;
  double reached_right = -1;
  for (int i = 0; i < 20000; ++i) {
    const Vec3d p = center + Vec3d{normal(random), normal(random), normal(random)}.normalized() * kRadius;
    const double x = 2 * (camera.fx * p.x / p.z + camera.cx + 0.5) / camera.width - 1;
    const double y = 1 - 2 * (camera.fy * p.y / p.z + camera.cy + 0.5) / camera.height;
    ASSERT_GE(x, static_cast<double>(rectangle[0]));
    ASSERT_GE(y, static_cast<double>(rectangle[1]));
    ASSERT_LE(x, static_cast<double>(rectangle[2]));
    ASSERT_LE(y, static_cast<double>(rectangle[3]));
    reached_right = std::max(reached_right, x);
  }
  // ... and little else: half a pixel of margin is 1/160 here.
  EXPECT_NEAR(reached_right, static_cast<double>(rectangle[2]), 0.01);
}

TEST(BuildInstances, BodiesOutOfViewAreNotDrawn) {
  const std::array<Body, 6> bodies = {sphere({0, 0, -1}, 0.1F),    sphere({5, 0, 1}, 0.1F),
                                      sphere({0, -5, 1}, 0.1F),    sphere({0, 0, 25}, 0.1F),
                                      sphere({0, 0, 0.01}, 0.01F), box({-5, 0, 1}, {0.1F, 0.1F, 0.1F})};
  const Built sut = build(bodies);
  EXPECT_EQ(sut.counts.spheres.in_view_count, 0U);
  EXPECT_EQ(sut.counts.meshes[kBoxMesh].in_view_count, 0U);
  EXPECT_EQ(sut.counts.left_out_count, 0U);
}

TEST(BuildInstances, SphereAroundTheEyesPlaneMayCoverTheWholePicture) {
  const std::array<Body, 1> bodies = {sphere({0.3, 0, 0.1}, 0.25F)};
  const Built sut = build(bodies);
  ASSERT_EQ(sut.counts.spheres.in_view_count, 1U);
  EXPECT_EQ(sut.spheres[0].rectangle_ndc, (std::array<float, 4>{-1, -1, 1, 1}));
}

TEST(BuildInstances, ValuesThatAreNotFiniteAreLeftOutAlone) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr float kInfinite = std::numeric_limits<float>::infinity();
  const std::array<Body, 4> bodies = {sphere({kNan, 0, 1}, 0.1F), sphere({0, 0, 1}, kInfinite),
                                      box({0, 0, 1}, {0.1F, 0.1F, 0.1F}, {kNan, 0, 0, 0}),
                                      sphere({0, 0, 1}, 0.1F)};
  const Built sut = build(bodies);
  EXPECT_EQ(sut.counts.spheres.in_view_count, 1U);
  EXPECT_EQ(sut.counts.meshes[kBoxMesh].in_view_count, 0U);
}

TEST(BuildInstances, PoseCarriesBodiesIntoTheCamera) {
  // The camera stands at (1, 2, 3) and looks along world -x: z_depth = -x_world, x_depth = -z_world, y_depth
  // = -y_world would be left-handed; x_depth = z_world completes it.
  T_WorldDepth T_world_depth;
  T_world_depth.rotation = Rotation{{0, 0, -1, 0, -1, 0, -1, 0, 0}};
  T_world_depth.translation = {1, 2, 3};
  const std::array<Body, 2> bodies = {sphere({-1, 2.1, 3}, 0.1F), box({-1, 2, 2.9}, {0.1F, 0.2F, 0.3F})};
  const Built sut = build(bodies, T_world_depth);
  ASSERT_EQ(sut.counts.spheres.in_view_count, 1U);
  ASSERT_EQ(sut.counts.meshes[kBoxMesh].in_view_count, 1U);
  EXPECT_NEAR(static_cast<double>(sut.spheres[0].center_depth_m.x), 0, 1e-6);
  EXPECT_NEAR(static_cast<double>(sut.spheres[0].center_depth_m.y), -0.1, 1e-6);
  EXPECT_NEAR(static_cast<double>(sut.spheres[0].center_depth_m.z), 2, 1e-6);
  EXPECT_NEAR(static_cast<double>(sut.meshes[0].center_depth_m.x), 0.1, 1e-6);
  EXPECT_EQ(sut.meshes[0].half_axes_depth_m[0], (Vec3f{0, 0, -0.1F}));
  EXPECT_EQ(sut.meshes[0].half_axes_depth_m[1], (Vec3f{0, -0.2F, 0}));
  EXPECT_EQ(sut.meshes[0].half_axes_depth_m[2], (Vec3f{-0.3F, 0, 0}));
}

TEST(BuildInstances, WhenFullTheFirstOnesAreKeptAndTheRestCounted) {
  std::array<Body, 20> bodies;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    bodies[i] = sphere({0, 0, 1}, 0.1F);
    bodies[i].color = {static_cast<std::uint8_t>(i), 0, 0};
  }
  const Built sut = build(bodies);
  EXPECT_EQ(sut.counts.spheres.in_view_count, 8U);
  EXPECT_EQ(sut.counts.left_out_count, 12U);
  for (std::size_t i = 0; i < 8; ++i) EXPECT_EQ(sut.spheres[i].color[0], i);
}

TEST(BuildInstances, MeshesLieInRunsWithThoseInViewFirst) {
  const auto shaped = [](Shape shape, Vec3d center, std::uint16_t hull = 0) {
    Body body;
    body.shape = shape;
    body.half_extent_m = {0.05F, 0.06F, 0.07F};
    body.half_length_m = 0.1F;
    body.center_world_m = center;
    body.hull_index = hull;
    return body;
  };
  const Vec3d seen{0, 0, 1}, behind{0, 0, -1}, far_behind{0, 0, -8};
  const std::array<Body, 9> bodies = {
      shaped(Shape::hull, seen, 1),   shaped(Shape::box, behind),    shaped(Shape::capsule, seen),
      shaped(Shape::box, seen),       shaped(Shape::cylinder, seen), shaped(Shape::hull, seen, 7),
      shaped(Shape::box, far_behind), shaped(Shape::sphere, behind), shaped(Shape::hull, {0.1, 0, 1}, 1)};
  const Built sut = build(bodies);
  const auto& meshes = sut.counts.meshes;
  EXPECT_EQ(meshes[kBoxMesh].in_view_count, 1U);
  EXPECT_EQ(meshes[kBoxMesh].count, 2U);
  EXPECT_EQ(meshes[kCapsuleMesh].count, 1U);
  EXPECT_EQ(meshes[kCylinderMesh].count, 1U);
  EXPECT_EQ(meshes[kFirstHullMesh].count, 0U);
  EXPECT_EQ(meshes[kFirstHullMesh + 1].in_view_count, 2U);
  EXPECT_EQ(sut.counts.spheres.in_view_count, 0U);
  EXPECT_EQ(sut.counts.spheres.count, 1U);
  EXPECT_EQ(sut.counts.in_view_count, 5U);
  EXPECT_EQ(sut.counts.casters_count, 7U);
  EXPECT_EQ(sut.meshes[meshes[kBoxMesh].first].center_depth_m, (Vec3f{0, 0, 1}));
  EXPECT_EQ(sut.meshes[meshes[kBoxMesh].first + 1].center_depth_m, (Vec3f{0, 0, -1}));
  EXPECT_EQ(sut.meshes[meshes[kFirstHullMesh + 1].first + 1].center_depth_m, (Vec3f{0.1F, 0, 1}));
  EXPECT_EQ(sut.meshes[meshes[kFirstHullMesh + 1].first].half_axes_depth_m[0], (Vec3f{1, 0, 0}));
  EXPECT_EQ(sut.meshes[meshes[kCylinderMesh].first].half_axes_depth_m[2], (Vec3f{0, 0, 0.1F}));
  EXPECT_EQ(sut.meshes[meshes[kCapsuleMesh].first].half_axes_depth_m[2], (Vec3f{0, 0, 0.05F}));
  EXPECT_EQ(sut.meshes[meshes[kCapsuleMesh].first].half_length_m, 0.1F);
}

}  // namespace
}  // namespace tactus::render
