#include "hal/synthetic/raycast.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "hal/synthetic/trajectory.hpp"

namespace tactus::hal::synthetic {
namespace {

constexpr unsigned kSeed = 11;

/// Walks the ray by the scene's own distance until the surface: knows nothing of tiles, bounds or closed
/// forms.
double sphere_trace(const Scene& scene, const Vec3d& origin, const Vec3d& direction) {
  const double per_z = direction.norm();
  double z = 0;
  for (int step = 0; step < 100000 && z < 60; ++step) {
    const double d = scene.distance(origin + direction * z);
    if (d < 1e-7) return z;
    z += d / per_z;
  }
  return 0;
}

class RaycastOf : public testing::TestWithParam<SceneId> {};
INSTANTIATE_TEST_SUITE_P(Scenes, RaycastOf,
                         testing::Values(SceneId::bedroom, SceneId::office, SceneId::wall, SceneId::corner),
                         [](const auto& scene) { return std::string(name(scene.param)); });

TEST_P(RaycastOf, DepthLabelAndNormalEqualTheSphereTracedOnes) {
  SyntheticOptions options;
  options.scene = GetParam();
  const Scene scene = make_scene(options.scene);
  const Intrinsics k = calibration_of(options).depth;
  Raycaster sut(scene, k);
  Hits hits(static_cast<std::size_t>(k.width) * static_cast<std::size_t>(k.height));
  std::mt19937 random(kSeed);
  for (const int frame : {0, 61, 133, 238}) {
    const T_WorldDepth pose = pose_at(options, scene.loop(), frame);
    sut.cast(pose, hits);
    sut.find_normals(pose, hits);
    for (int i = 0; i < 1500; ++i) {
      const auto pixel = random() % hits.pixels_count();
      const auto column = static_cast<int>(pixel) % k.width, row = static_cast<int>(pixel) / k.width;
      const Vec3d direction = pose.rotation * Vec3d{(column - k.cx) / k.fx, (row - k.cy) / k.fy, 1};
      const double oracle_m = sphere_trace(scene, pose.translation, direction);
      const auto z = static_cast<double>(hits.depth_m[pixel]);
      SCOPED_TRACE(testing::Message()
                   << "frame " << frame << " pixel " << column << "," << row << " seed " << kSeed);
      if (oracle_m == 0) {
        EXPECT_EQ(hits.primitive[pixel], kNoPrimitive);
        continue;
      }
      ASSERT_NE(hits.primitive[pixel], kNoPrimitive);
      // The oracle stops 0.1 um before the surface, which a grazing ray reaches later.
      const Vec3d n{static_cast<double>(hits.normal_x[pixel]), static_cast<double>(hits.normal_y[pixel]),
                    static_cast<double>(hits.normal_z[pixel])};
      const double slack_m = 1e-6 + 4e-7 / std::max(-n.dot(direction), 1e-2);
      EXPECT_NEAR(z, oracle_m, slack_m);
      const Vec3d hit = pose.translation + direction * z;
      // In contact lines two solids are equally near and either may answer.
      const Primitive& solid = scene.primitives()[hits.primitive[pixel]];
      EXPECT_NEAR(local_distance(solid, solid.to_local(hit)), 0, 2e-6);
      if (scene.nearest(hit).primitive_index == hits.primitive[pixel]) {
        EXPECT_LT((scene.normal(pose.translation + direction * (z - 1e-5)) - n).norm(), 0.02);
      }
    }
  }
}

TEST(PixelRays, DistortedRaysProjectBackToTheirPixels) {
  SyntheticOptions options;
  options.is_registered = false;
  const Intrinsics k = calibration_of(options).color;
  const PixelRays sut(k);
  for (int row = 0; row < k.height; row += 7)
    for (int column = 0; column < k.width; column += 7) {
      const double x = sut.x(column, row), y = sut.y(column, row), r2 = x * x + y * y;
      const double radial = 1 + k.k1 * r2 + k.k2 * r2 * r2 + k.k3 * r2 * r2 * r2;
      const double xd = x * radial + 2 * k.p1 * x * y + k.p2 * (r2 + 2 * x * x);
      const double yd = y * radial + k.p1 * (r2 + 2 * y * y) + 2 * k.p2 * x * y;
      ASSERT_NEAR(k.fx * xd + k.cx, column, 1e-6);
      ASSERT_NEAR(k.fy * yd + k.cy, row, 1e-6);
    }
}

}  // namespace
}  // namespace tactus::hal::synthetic
