#include "pipeline/render/camera.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace tactus::render {
namespace {

struct Window {
  double u = 0, v = 0, depth = 0;  // our pixel coordinates; GL window depth 0 to 1
};

Window window_of(const Projection& p, const hal::Intrinsics& camera, const Vec3d& point) {
  const double in[4] = {point.x, point.y, point.z, 1};
  double clip[4] = {};
  for (std::size_t column = 0; column < 4; ++column)
    for (std::size_t row = 0; row < 4; ++row)
      clip[row] += static_cast<double>(p[column * 4 + row]) * in[column];
  const double x = clip[0] / clip[3], y = clip[1] / clip[3], z = clip[2] / clip[3];
  // GL: window = (ndc + 1) / 2 * size, pixel centres at halves, row 0 at the bottom.
  return {(x + 1) / 2 * camera.width - 0.5, camera.height - (y + 1) / 2 * camera.height - 0.5, (z + 1) / 2};
}

TEST(ProjectionMatrix, AnyPointInViewFallsOnItsPixel) {
  constexpr unsigned kSeed = 20240511;
  SCOPED_TRACE(kSeed);
  std::mt19937 random(kSeed);
  const auto uniform = [&random](double low, double high) {
    return low + (high - low) * static_cast<double>(random()) / static_cast<double>(std::mt19937::max());
  };
  for (int i = 0; i < 2000; ++i) {
    hal::Intrinsics camera;
    camera.width = static_cast<int>(uniform(40, 1920));
    camera.height = static_cast<int>(uniform(40, 1080));
    camera.fx = uniform(0.5, 2) * camera.width;
    camera.fy = uniform(0.5, 2) * camera.width;
    camera.cx = uniform(0.3, 0.7) * camera.width;
    camera.cy = uniform(0.3, 0.7) * camera.height;
    const double u = uniform(-0.5, camera.width - 0.5), v = uniform(-0.5, camera.height - 0.5),
                 z = uniform(0.1, 15);
    const Vec3d point{(u - camera.cx) / camera.fx * z, (v - camera.cy) / camera.fy * z, z};
    const Window window = window_of(projection_matrix(camera, {0.05F, 20.0F}), camera, point);
    EXPECT_NEAR(window.u, u, 1e-3);
    EXPECT_NEAR(window.v, v, 1e-3);
    EXPECT_GT(window.depth, 0);
    EXPECT_LT(window.depth, 1);
  }
}

TEST(ProjectionMatrix, NearAndFarMapToTheEndsOfTheDepthBuffer) {
  hal::Intrinsics camera;
  camera.width = 640;
  camera.height = 480;
  camera.fx = camera.fy = 525;
  camera.cx = 319.5;
  camera.cy = 239.5;
  const Projection sut = projection_matrix(camera, {0.1F, 10.0F});
  EXPECT_NEAR(window_of(sut, camera, {0, 0, 0.1}).depth, 0, 1e-6);
  EXPECT_NEAR(window_of(sut, camera, {0, 0, 10.0}).depth, 1, 1e-6);
}

TEST(ProjectionMatrixDeathTest, DistortedCameraIsABug) {
  hal::Intrinsics camera;
  camera.width = 64;
  camera.height = 48;
  camera.fx = camera.fy = 50;
  camera.k1 = 0.1;
  EXPECT_DEATH((void)projection_matrix(camera, {}), "assertion failed");
}

}  // namespace
}  // namespace tactus::render
