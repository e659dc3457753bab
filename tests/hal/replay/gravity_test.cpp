#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "hal/replay/file_bytes.hpp"
#include "hal/replay/gravity_file.hpp"
#include "hal/replay/poses.hpp"
#include "tests/support/shared_data.hpp"

namespace tactus::hal::replay {
namespace {

double degrees_between(const Vec3d& a, const Vec3d& b) {
  return std::acos(std::clamp(a.dot(b) / (a.norm() * b.norm()), -1.0, 1.0)) * 180 / 3.14159265358979;
}

TEST(GravityFile, ThreeNumbersBecomeAUnitVector) {
  auto sut = parse_gravity("# down\n0\n3\n4\n", "gravity.txt");
  ASSERT_TRUE(sut.has_value());
  EXPECT_NEAR(sut->y, 0.6, 1e-15);
  EXPECT_NEAR(sut->z, 0.8, 1e-15);
}

TEST(GravityFile, WhatIsNoDirectionIsRefused) {
  for (const char* text : {"", "0 0 0", "1 2", "1 2 3 4", "nan 0 1", "1e200 0 0", "down"}) {
    auto sut = parse_gravity(text, "gravity.txt");
    ASSERT_FALSE(sut.has_value()) << text;
    EXPECT_EQ(sut.error().code, rt::ExitCode::bad_input);
    EXPECT_TRUE(sut.error().message.starts_with("gravity.txt")) << sut.error().message;
  }
}

TEST(Accelerometer, LevelCameraFeelsGravityDownward) {
  // A level camera at rest: the Kinect's y axis points up and measures +g.
  const auto sut = gravity_from_accelerometer("1.00 0 9.8 0\n1.01 0 9.8 0\n1.02 0 9.8 0\n", {1'000'000'000});
  ASSERT_TRUE(sut.has_value());
  EXPECT_NEAR(sut->y, 1, 1e-12);
}

TEST(Accelerometer, FarOrShakenSamplesSayNothing) {
  const char* quiet = "1.00 0 9.8 0\n1.01 0 9.8 0\n1.02 0 9.8 0\n";
  EXPECT_EQ(gravity_from_accelerometer(quiet, {2'000'000'000}), std::nullopt);
  EXPECT_EQ(gravity_from_accelerometer("1.00 0 9.8 0\n1.01 0 9.8 0\n", {1'000'000'000}), std::nullopt);
  EXPECT_EQ(gravity_from_accelerometer("1 0 1 0\n1.01 0 1 0\n1.02 0 1 0\n", {1'000'000'000}), std::nullopt);
  EXPECT_EQ(gravity_from_accelerometer("nan x\n1 0 nan 0\n", {1'000'000'000}), std::nullopt);
}

TEST(Accelerometer, AxesAgreeWithMotionCapture) {
  const auto folder = test::shared_data("tum_fr1_rpy");
  if (!folder) GTEST_SKIP() << "the TUM recording is absent";
  std::string samples, poses;
  ASSERT_TRUE(read_file(*folder / "accelerometer.txt", kTextBytesMax, samples));
  ASSERT_TRUE(read_file(*folder / "groundtruth.txt", kTextBytesMax, poses));
  const Trajectory truth = parse_trajectory(poses, "groundtruth.txt");
  ASSERT_GT(truth.poses.size(), 800U);

  // Against each of the 24 ways to name the axes anew: ours must be by far the best.
  constexpr std::array<std::array<int, 3>, 6> kOrders{
      {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}}};
  std::array<std::array<double, 8>, 6> sums{};
  int count = 0;
  for (std::size_t i = 0; i < truth.poses.size(); i += 8) {
    const auto gravity = gravity_from_accelerometer(samples, truth.poses[i].time);
    if (!gravity) continue;
    ++count;
    const std::array<double, 3> g{gravity->x, gravity->y, gravity->z};
    const Vec3d down = truth.poses[i].T_world_depth.rotation.transposed() * Vec3d{0, 0, -1};
    for (std::size_t order = 0; order < 6; ++order)
      for (std::size_t signs = 0; signs < 8; ++signs) {
        const auto axis = [&](std::size_t k) {
          return (signs >> k & 1 ? -1 : 1) * g[static_cast<std::size_t>(kOrders[order][k])];
        };
        sums[order][signs] += degrees_between({axis(0), axis(1), axis(2)}, down);
      }
  }
  ASSERT_GT(count, 80);
  const double ours = sums[0][0] / count;
  EXPECT_LT(ours, 5.0) << "degrees";
  for (std::size_t order = 0; order < 6; ++order)
    for (std::size_t signs = 0; signs < 8; ++signs)
      if (order != 0 || signs != 0) {
        EXPECT_GT(sums[order][signs] / count, 2 * ours) << order << ' ' << signs;
      }
}

}  // namespace
}  // namespace tactus::hal::replay
