#include "pipeline/evaluate/overlay.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace tactus::evaluate {
namespace {

hal::Intrinsics camera() {
  hal::Intrinsics c;
  c.width = 640;
  c.height = 480;
  c.fx = c.fy = 500;
  c.cx = 319.5;
  c.cy = 239.5;
  return c;
}

StampedPose at(std::int64_t time_ns, const Vec3d& position) {
  StampedPose pose;
  pose.time = {time_ns};
  pose.T_world_depth.translation = position;
  return pose;
}

TEST(Overlay, SidewaysErrorIsItsImageAtTheDepth) {
  const std::vector<StampedPose> drawn = {at(0, {0.004, 0, 0})}, truth = {at(0, {})};
  const OverlayError error = overlay_error(drawn, truth, {}, camera(), 2);
  EXPECT_EQ(error.poses_count, 1U);
  EXPECT_NEAR(error.p50_px, 500 * 0.004 / 2, 1e-9);
  EXPECT_NEAR(error.max_px, 1, 1e-9);
}

TEST(Overlay, AlignmentTakesTheWorldsApartOut) {
  const std::vector<StampedPose> drawn = {at(0, {1, 2, 3})}, truth = {at(0, {})};
  EXPECT_NEAR(overlay_error(drawn, truth, {{}, {-1, -2, -3}}, camera(), 2).p50_px, 0, 1e-9);
}

TEST(Overlay, PercentilesAreOverPosesAndUnpairedOnesDoNotCount) {
  std::vector<StampedPose> drawn, truth;
  for (std::int64_t i = 0; i < 100; ++i) {
    drawn.push_back(at(i * 33'000'000, {0.004 * static_cast<double>(i + 1), 0, 0}));
    truth.push_back(at(i * 33'000'000, {}));
  }
  drawn.push_back(at(1'000'000'000'000, {}));
  const OverlayError error = overlay_error(drawn, truth, {}, camera(), 2);
  EXPECT_EQ(error.poses_count, 100U);
  EXPECT_NEAR(error.p50_px, 50, 1e-9);
  EXPECT_NEAR(error.p95_px, 95, 1e-9);
  EXPECT_NEAR(error.max_px, 100, 1e-9);
}

TEST(Overlay, NothingInCommonIsNoError) {
  EXPECT_EQ(overlay_error({}, {}, {}, camera(), 2).poses_count, 0U);
}

}  // namespace
}  // namespace tactus::evaluate
