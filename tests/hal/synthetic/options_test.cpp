#include "hal/synthetic/options.hpp"

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

namespace tactus::hal::synthetic {
namespace {

TEST(SyntheticName, SceneAloneGivesDefaults) {
  const auto sut = parse_synthetic_name("synthetic:bedroom");
  ASSERT_TRUE(sut) << sut.error().message;
  EXPECT_EQ(sut->scene, SceneId::bedroom);
  EXPECT_EQ(sut->mode, Mode::vga_640x480);
  EXPECT_EQ(sut->frames_count, 300);
  EXPECT_TRUE(sut->has_noise);
  EXPECT_TRUE(sut->is_registered);
  EXPECT_EQ(sut->trajectory, TrajectoryKind::handheld);
  EXPECT_EQ(sut->blank_count, 0);
  EXPECT_FALSE(sut->has_jump);
}

TEST(SyntheticName, EveryOptionIsRead) {
  const auto sut = parse_synthetic_name(
      "synthetic:office?noise=0&frames=60&mode=960x540@30&trajectory=still&seed=7&registered=0&blank=100:6&"
      "jump=1");
  ASSERT_TRUE(sut) << sut.error().message;
  EXPECT_EQ(sut->scene, SceneId::office);
  EXPECT_EQ(sut->mode, Mode::wide_960x540);
  EXPECT_EQ(sut->frames_count, 60);
  EXPECT_FALSE(sut->has_noise);
  EXPECT_FALSE(sut->is_registered);
  EXPECT_EQ(sut->trajectory, TrajectoryKind::still);
  EXPECT_EQ(sut->seed, 7U);
  EXPECT_EQ(sut->blank_first, 100);
  EXPECT_EQ(sut->blank_count, 6);
  EXPECT_TRUE(sut->has_jump);
}

TEST(SyntheticName, PrefixMayBeMissing) {
  const auto sut = parse_synthetic_name("corner?mode=320x240");
  ASSERT_TRUE(sut);
  EXPECT_EQ(sut->scene, SceneId::corner);
  EXPECT_EQ(sut->mode, Mode::qvga_320x240);
}

TEST(SyntheticName, BadNamesNameTheWrongWord) {
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"synthetic:", "bedroom"},
      {"synthetic:cellar", "'cellar'"},
      {"synthetic:bedroom?frames=0", "'frames=0'"},
      {"synthetic:bedroom?frames=-3", "'frames=-3'"},
      {"synthetic:bedroom?frames=12x", "'frames=12x'"},
      {"synthetic:bedroom?frames=99999999999999999999", "frames"},
      {"synthetic:bedroom?frames", "'frames'"},
      {"synthetic:bedroom?noise=2", "noise=1"},
      {"synthetic:bedroom?noise=", "noise=1"},
      {"synthetic:bedroom?mode=800x600", "960x540"},
      {"synthetic:bedroom?mode=640x480@60", "640x480"},
      {"synthetic:bedroom?trajectory=fly", "handheld"},
      {"synthetic:bedroom?seed=-1", "seed"},
      {"synthetic:bedroom?blank=100", "FIRST:COUNT"},
      {"synthetic:bedroom?blank=a:b", "FIRST:COUNT"},
      {"synthetic:bedroom?blank=10:0", "FIRST:COUNT"},
      {"synthetic:bedroom?jump=1", "blank"},
      {"synthetic:bedroom?color=1", "'color=1'"},
      {"synthetic:bedroom?noise=0&&seed=1", "key=value"},
  };
  for (const auto& [name, expected] : cases) {
    const auto sut = parse_synthetic_name(name);
    ASSERT_FALSE(sut) << name;
    EXPECT_EQ(sut.error().code, rt::ExitCode::bad_usage) << name;
    EXPECT_NE(sut.error().message.find(expected), std::string::npos) << sut.error().message;
    EXPECT_NE(sut.error().message.find(name), std::string::npos) << sut.error().message;
  }
}

TEST(SyntheticCalibration, ModesSeeTheSameRaysAtPixelEdges) {
  SyntheticOptions options;
  const Intrinsics vga = calibration_of(options).depth;
  EXPECT_EQ(vga.fx, 525);
  EXPECT_EQ(vga.cx, 319.5);
  EXPECT_EQ(vga.cy, 239.5);
  options.mode = Mode::qvga_320x240;
  const Intrinsics half = calibration_of(options).depth;
  // The image's left edge is half a pixel left of the first pixel's centre in either mode.
  EXPECT_DOUBLE_EQ((-0.5 - half.cx) / half.fx, (-0.5 - vga.cx) / vga.fx);
  EXPECT_DOUBLE_EQ((half.height - 0.5 - half.cy) / half.fy, (vga.height - 0.5 - vga.cy) / vga.fy);
  options.mode = Mode::wide_960x540;
  const Intrinsics wide = calibration_of(options).depth;
  EXPECT_EQ(wide.width, 960);
  EXPECT_EQ(wide.height, 540);
  EXPECT_DOUBLE_EQ((-0.5 - wide.cx) / wide.fx, (-0.5 - vga.cx) / vga.fx);
  EXPECT_DOUBLE_EQ(wide.cy, 269.5);
}

TEST(SyntheticCalibration, UnregisteredColorIsAnotherCamera) {
  SyntheticOptions options;
  options.is_registered = false;
  const RigCalibration sut = calibration_of(options);
  EXPECT_FALSE(sut.registered);
  EXPECT_TRUE(sut.color.has_distortion());
  EXPECT_NE(sut.color.fx, sut.depth.fx);
  EXPECT_GT(sut.T_color_depth.translation.norm(), 0.025);
  EXPECT_LT(sut.T_color_depth.translation.norm(), 0.050);
}

}  // namespace
}  // namespace tactus::hal::synthetic
