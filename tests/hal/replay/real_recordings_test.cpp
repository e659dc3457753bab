// The three recordings beside the project, each read to its end.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "hal/replay/replay.hpp"
#include "tests/hal/replay/recording_folder.hpp"
#include "tests/support/shared_data.hpp"

namespace tactus::hal::replay {
namespace {

Sensor open(const std::filesystem::path& folder, const ReplayOptions& options) {
  auto sensor = open_replay(folder, options);
  EXPECT_TRUE(sensor.has_value()) << (sensor ? "" : sensor.error().message);
  if (!sensor) std::abort();
  for (const std::string& note : sensor->notes) ADD_FAILURE() << "unexpected note: " << note;
  return std::move(*sensor);
}

struct Tally {
  std::uint64_t frames = 0, sequence_last = 0;
  double measured_share = 0;
};

Tally tally_depth(Sensor& sensor) {
  Tally out;
  const Intrinsics& k = sensor.calibration.depth;
  std::vector<std::uint16_t> pixels(static_cast<std::size_t>(k.width * k.height));
  FrameHeader header;
  std::uint64_t measured = 0;
  while (sensor.depth->read(pixels, header, kLong) == rt::Status::ok) {
    ++out.frames;
    out.sequence_last = header.sequence;
    measured += pixels.size() - static_cast<std::size_t>(std::count(pixels.begin(), pixels.end(), 0));
    EXPECT_EQ(std::count(pixels.begin(), pixels.end(), 65535), 0);
  }
  out.measured_share = static_cast<double>(measured) / static_cast<double>(pixels.size() * out.frames);
  EXPECT_EQ(sensor.depth->counters().first_rejection, "");
  return out;
}

std::uint64_t count_color(Sensor& sensor) {
  const Intrinsics& k = sensor.calibration.color;
  std::vector<std::uint8_t> pixels(static_cast<std::size_t>(k.width * k.height) * 3);
  FrameHeader header;
  std::uint64_t frames = 0;
  while (sensor.color->read(pixels, header, kLong) == rt::Status::ok) ++frames;
  EXPECT_EQ(sensor.color->counters().first_rejection, "");
  return frames;
}

TEST(RealRecording, TumRpyPlaysToItsEnd) {
  const auto folder = test::shared_data("tum_fr1_rpy");
  if (!folder) GTEST_SKIP() << "the TUM recording is absent";
  Sensor sut = open(*folder, {.prefetch = 4});
  EXPECT_EQ(sut.frames_count, 140U);
  EXPECT_EQ(sut.frame_rate_hz, 30);
  EXPECT_TRUE(sut.calibration.registered);
  EXPECT_EQ(sut.truth.size(), 869U);
  const Tally depth = tally_depth(sut);
  EXPECT_EQ(depth.frames, 140U);
  EXPECT_GT(depth.measured_share, 0.5);
  EXPECT_EQ(count_color(sut), 140U);
  // Motion capture says which way is down in the first frame.
  ASSERT_TRUE(sut.gravity_depth.has_value());
  const rt::SensorTime start{1305031229528784000};
  const auto pose =
      std::find_if(sut.truth.begin(), sut.truth.end(), [&](const TruthPose& p) { return !(p.time < start); });
  ASSERT_NE(pose, sut.truth.end());
  const Vec3d down = pose->T_world_depth.rotation.transposed() * Vec3d{0, 0, -1};
  EXPECT_GT(sut.gravity_depth->dot(down), 0.99) << "within 8 degrees";
}

TEST(RealRecording, KitchenPlaysToItsEnd) {
  const auto folder = test::shared_data("kitchen_7scenes");
  if (!folder) GTEST_SKIP() << "the kitchen recording is absent";
  Sensor sut = open(*folder, {.prefetch = 4});
  EXPECT_EQ(sut.frames_count, 121U);
  EXPECT_EQ(sut.truth.size(), 121U);
  EXPECT_FALSE(sut.calibration.registered);
  EXPECT_EQ(sut.calibration.color.fx, 526.2);
  EXPECT_EQ(sut.calibration.T_color_depth.translation.x, -0.03107);
  const Tally depth = tally_depth(sut);
  EXPECT_EQ(depth.frames, 121U);
  EXPECT_EQ(depth.sequence_last, 120U);
  EXPECT_GT(depth.measured_share, 0.5);
  EXPECT_EQ(count_color(sut), 121U);
}

/// Share of the frame's surface normals within 5 degrees of `direction` or its opposite.
double share_along(const std::vector<std::uint16_t>& depth, const Intrinsics& k, Vec3d direction) {
  const auto point = [&](int x, int y) {
    const double z = 0.001 * depth[static_cast<std::size_t>(y * k.width + x)];
    return Vec3d{(x - k.cx) / k.fx * z, (y - k.cy) / k.fy * z, z};
  };
  constexpr int kReach = 8;
  int normals_count = 0, along_count = 0;
  for (int y = kReach; y < k.height - kReach; y += 4)
    for (int x = kReach; x < k.width - kReach; x += 4) {
      const Vec3d left = point(x - kReach, y), right = point(x + kReach, y), up = point(x, y - kReach),
                  down = point(x, y + kReach);
      if (left.z <= 0.4 || right.z <= 0.4 || up.z <= 0.4 || down.z <= 0.4) continue;
      const Vec3d a = right - left, b = down - up;
      if (a.norm() > 0.2 || b.norm() > 0.2) continue;
      ++normals_count;
      along_count += std::fabs(a.cross(b).normalized().dot(direction)) > 0.99619 ? 1 : 0;
    }
  return static_cast<double>(along_count) / normals_count;
}

TEST(RealRecording, KitchenGravityIsInTheWorldOfThePoses) {
  const auto folder = test::shared_data("kitchen_7scenes");
  if (!folder) GTEST_SKIP() << "the kitchen recording is absent";
  // Were it in the first camera's frame, the worktop's and floor's normals would lie elsewhere.
  const Vec3d as_written = Vec3d{-0.0088746, 0.9044256, 0.4265392}.normalized();
  double in_world = 0, in_first_camera = 0;
  for (const std::uint64_t first : {0U, 30U, 60U, 90U, 120U}) {
    Sensor sut = open(*folder, {.first = first, .last = first + 1});
    std::vector<std::uint16_t> depth(640 * 480);
    FrameHeader header;
    ASSERT_EQ(sut.depth->read(depth, header, kLong), rt::Status::ok);
    ASSERT_TRUE(sut.gravity_depth.has_value());
    in_world += share_along(depth, sut.calibration.depth, *sut.gravity_depth);
    const auto pose_at = [&](std::uint64_t i) { return sut.truth[i].T_world_depth.rotation; };
    const Vec3d turned = pose_at(first).transposed() * (pose_at(0) * as_written);
    in_first_camera += share_along(depth, sut.calibration.depth, turned);
  }
  EXPECT_GT(in_world, 1.5 * in_first_camera);
  EXPECT_GT(in_world / 5, 0.1);
}

TEST(RealRecording, RenderedBedroomPlaysToItsEndWithLabels) {
  const auto folder = test::shared_data("bedroom_rendered");
  if (!folder) GTEST_SKIP() << "the rendered bedroom is absent";
  Sensor sut = open(*folder, {.prefetch = 4});
  EXPECT_EQ(sut.frames_count, 240U);
  EXPECT_EQ(sut.truth.size(), 240U);
  EXPECT_EQ(sut.calibration.depth.width, 640);
  EXPECT_EQ(sut.calibration.depth.height, 360);
  EXPECT_EQ(tally_depth(sut).frames, 240U);
  EXPECT_EQ(count_color(sut), 240U);
  ASSERT_NE(sut.labels, nullptr);
  std::vector<std::uint8_t> ids(640 * 360);
  std::uint64_t wood = 0;
  for (std::uint64_t i = 0; i < 240; i += 24) {
    ASSERT_EQ(sut.labels->read(i, ids), rt::Status::ok);
    wood += static_cast<std::uint64_t>(std::count(ids.begin(), ids.end(), 22));
  }
  // Its README says that 37 % of all pixels are wood.
  EXPECT_NEAR(static_cast<double>(wood) / (10.0 * 640 * 360), 0.37, 0.05);
}

}  // namespace
}  // namespace tactus::hal::replay
