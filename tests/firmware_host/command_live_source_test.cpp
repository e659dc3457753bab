// What is written after v4l2: and openni2:, and the sensor that is made of the cameras.
#include <gtest/gtest.h>

#include <random>
#include <string>
#include <vector>

#include "firmware_host/live_source.hpp"
#include "hal/replay/intrinsics_file.hpp"
#include "hal/synthetic/options.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tactus::firmware {
namespace {

TEST(LiveSource, EveryKeyOfV4l2IsTaken) {
  const auto s = parse_live_source(
      "v4l2:/dev/video2?color=/dev/video0&mode=960x540@30&color_mode=1280x720@29.97&format=Z16&color_format=YUYV"
      "&buffers=dmabuf:/dev/udmabuf&calibration=rig.toml&controls=gain:10,exposure:Manual Mode"
      "&color_controls=brightness:-3&accelerometer=iio:device0");
  ASSERT_TRUE(s.has_value()) << s.error().message;
  EXPECT_EQ(s->kind, LiveKind::v4l2);
  EXPECT_EQ(s->device, "/dev/video2");
  EXPECT_EQ(s->color, "/dev/video0");
  EXPECT_EQ(s->mode.width, 960);
  EXPECT_EQ(s->mode.height, 540);
  EXPECT_EQ(s->mode.frame_rate_hz, 30);
  EXPECT_EQ(s->color_mode.frame_rate_hz, 29.97);
  EXPECT_EQ(s->format, "Z16");
  EXPECT_EQ(s->color_format, "YUYV");
  EXPECT_EQ(s->buffers, "dmabuf");
  EXPECT_EQ(s->dmabuf_exporter, "/dev/udmabuf");
  EXPECT_EQ(s->calibration, "rig.toml");
  EXPECT_EQ(s->controls, (Controls{{"gain", "10"}, {"exposure", "Manual Mode"}}));
  EXPECT_EQ(s->color_controls, (Controls{{"brightness", "-3"}}));
  EXPECT_EQ(s->accelerometer, "iio:device0");
}

TEST(LiveSource, OpenNi2WithAndWithoutUri) {
  const auto first = parse_live_source("openni2");
  ASSERT_TRUE(first.has_value());
  EXPECT_EQ(first->kind, LiveKind::openni2);
  EXPECT_TRUE(first->device.empty());
  EXPECT_FALSE(first->is_registered.has_value());
  const auto named = parse_live_source("openni2:1d27/0601@1/6?registered=1&sync=0&mode=@30");
  ASSERT_TRUE(named.has_value()) << named.error().message;
  EXPECT_EQ(named->device, "1d27/0601@1/6");
  EXPECT_EQ(named->is_registered, true);
  EXPECT_EQ(named->is_synchronized, false);
  EXPECT_EQ(named->mode.width, 0);
  EXPECT_EQ(named->mode.frame_rate_hz, 30);
  EXPECT_EQ(parse_live_source("openni2?color=libcamera:usb")->color, "libcamera:usb");
}

TEST(LiveSource, WhatIsWrongIsNamed) {
  const std::pair<const char*, const char*> kCases[] = {
      {"v4l2", "needs the node"},
      {"v4l2?mode=640x480", "needs the node"},
      {"v4l2:", "needs the node"},
      {"openni2:", "after ':'"},
      {"libcamera", "pair one"},
      {"libcamera:usb", "pair one"},
      {"v4l2:/dev/video0?colour=/dev/video1", "'colour' is no key"},
      {"v4l2:/dev/video0?registered=1", "'registered' is no key of v4l2"},
      {"openni2?buffers=mmap", "'buffers' is no key of openni2"},
      {"openni2?registered=yes", "registered takes 0 or 1, not 'yes'"},
      {"openni2?registered", "registered takes 0 or 1, not ''"},
      {"openni2?mode=640", "mode takes"},
      {"openni2?mode=0x480", "mode takes"},
      {"openni2?mode=640x480@0", "mode takes"},
      {"openni2?mode=640x480@nan", "mode takes"},
      {"openni2?mode=640x480&mode=320x240", "'mode' is there twice"},
      {"v4l2:/dev/video0?buffers=heap", "buffers takes"},
      {"v4l2:/dev/video0?buffers=mmap:x", "buffers takes"},
      {"v4l2:/dev/video0?buffers=dmabuf:", "buffers takes"},
      {"v4l2:/dev/video0?controls=gain", "controls takes"},
      {"v4l2:/dev/video0?controls=gain:", "controls takes"},
      {"v4l2:/dev/video0?controls=", "controls takes"},
      {"v4l2:/dev/video0?color=video1", "color takes"},
      {"v4l2:/dev/video0?color_mode=640x480", "color_mode needs color="},
      {"openni2?color=/dev/video0&registered=1", "registered=1"},
      {"openni2?accelerometer=device0", "accelerometer takes"},
      {"openni2?calibration=", "calibration takes"},
      {"openni2?&", "'' is no key"},
  };
  for (const auto& [source, part] : kCases) {
    const auto parsed = parse_live_source(source);
    ASSERT_FALSE(parsed.has_value()) << source;
    EXPECT_EQ(parsed.error().code, rt::ExitCode::bad_usage) << source;
    EXPECT_NE(parsed.error().message.find(part), std::string::npos) << parsed.error().message;
    EXPECT_NE(parsed.error().message.find(source), std::string::npos) << parsed.error().message;
  }
}

TEST(LiveSource, WordsPutTogetherAtRandomAreTakenOrToldOf) {
  const std::uint32_t seed = 20261130;
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  const std::vector<std::string> pieces = {"v4l2", "openni2", ":", "?", "&", "=", "mode", "color", "controls", "640x480",
                                           "@30",  "/dev/video0", ",", "buffers", "dmabuf", "1", "registered", "\xFF",
                                           "libcamera", "calibration", " ", "x", "@", "-1", "sync", "accelerometer"};
  int taken_count = 0;
  for (int i = 0; i < 20000; ++i) {
    std::string source = i % 2 == 0 ? "v4l2:/dev/video0?" : "openni2?";
    for (unsigned n = random() % 8; n > 0; --n) source += pieces[random() % pieces.size()];
    const auto parsed = parse_live_source(source);
    taken_count += parsed.has_value();
    if (!parsed) {
      EXPECT_EQ(parsed.error().code, rt::ExitCode::bad_usage);
      EXPECT_NE(parsed.error().message.find(source), std::string::npos) << source;
    }
  }
  EXPECT_GT(taken_count, 1000);
}

TEST(LiveSource, KindIsAWholeWord) {
  for (const char* live : {"v4l2", "v4l2:/dev/video0", "openni2?x", "libcamera:a"}) EXPECT_TRUE(is_live_source(live));
  for (const char* other : {"v4l2x", "openni", "folder/v4l2", "openni2.oni", ""}) EXPECT_FALSE(is_live_source(other));
}

TEST(LiveSource, ModesReadBackAsWritten) {
  for (const char* text : {"640x480", "640x480@30", "@59.94", "1x8192@1000"}) {
    const auto mode = parse_mode(text);
    ASSERT_TRUE(mode.has_value()) << text;
    EXPECT_EQ(mode_text(*mode), text);
  }
}

hal::RigCalibration rig() {
  hal::synthetic::SyntheticOptions options;
  options.is_registered = false;
  return hal::synthetic::calibration_of(options);
}

TEST(FitCalibration, SameSizeChangesNothing) {
  const auto fitted = fit_calibration(rig(), "f", {640, 480}, {640, 480});
  ASSERT_TRUE(fitted.has_value());
  EXPECT_EQ(fitted->depth, rig().depth);
  EXPECT_EQ(fitted->color, rig().color);
}

TEST(FitCalibration, HalfTheSizeSeesTheSameDirections) {
  const auto fitted = fit_calibration(rig(), "f", {320, 240}, {1280, 960});
  ASSERT_TRUE(fitted.has_value()) << fitted.error().message;
  // The direction of the image's left edge, half a pixel beside the first centre, is the same.
  const auto left = [](const hal::Intrinsics& k) { return (-0.5 - k.cx) / k.fx; };
  const auto bottom = [](const hal::Intrinsics& k) { return (k.height - 0.5 - k.cy) / k.fy; };
  EXPECT_NEAR(left(fitted->depth), left(rig().depth), 1e-12);
  EXPECT_NEAR(bottom(fitted->color), bottom(rig().color), 1e-12);
  EXPECT_EQ(fitted->color.k1, rig().color.k1);
}

TEST(FitCalibration, AnotherShapeIsRefused) {
  const auto fitted = fit_calibration(rig(), "rig.toml", {960, 540}, {640, 480});
  ASSERT_FALSE(fitted.has_value());
  EXPECT_NE(fitted.error().message.find("rig.toml: [depth] is of 640x480"), std::string::npos)
      << fitted.error().message;
}

TEST(FitCalibration, ColourThatItDoesNotKnowIsRefused) {
  hal::RigCalibration depth_only = rig();
  depth_only.has_color = false;
  EXPECT_FALSE(fit_calibration(depth_only, "f", {640, 480}, {640, 480}).has_value());
  hal::RigCalibration registered = rig();
  registered.registered = true;
  EXPECT_FALSE(fit_calibration(registered, "f", {640, 480}, {1280, 960}).has_value());
  const auto both = fit_calibration(registered, "f", {320, 240}, {320, 240});
  ASSERT_TRUE(both.has_value());
  EXPECT_EQ(both->color, both->depth);
  const auto alone = fit_calibration(rig(), "f", {640, 480}, {});
  ASSERT_TRUE(alone.has_value());
  EXPECT_FALSE(alone->has_color);
}

class NoDepth final : public hal::DepthCamera {
 public:
  rt::Status read(std::span<std::uint16_t>, hal::FrameHeader&, rt::Duration) override { return rt::Status::timeout; }
  [[nodiscard]] const hal::CameraCounters& counters() const override { return counters_; }

 private:
  hal::CameraCounters counters_;
};

class NoColor final : public hal::ColorCamera {
 public:
  rt::Status read(std::span<std::uint8_t>, hal::FrameHeader&, rt::Duration) override { return rt::Status::timeout; }
  rt::Status peek(hal::FrameHeader&, rt::Duration) override { return rt::Status::timeout; }
  void skip() override {}
  [[nodiscard]] const hal::CameraCounters& counters() const override { return counters_; }

 private:
  hal::CameraCounters counters_;
};

hal::LiveCamera<hal::DepthCamera> depth_camera(bool has_host_clock) {
  hal::LiveCamera<hal::DepthCamera> camera;
  camera.camera = std::make_unique<NoDepth>();
  camera.width = 640;
  camera.height = 480;
  camera.has_host_clock = has_host_clock;
  camera.buffers_bytes = 100;
  camera.description = "depth node";
  camera.notes = {"a"};
  return camera;
}

hal::LiveCamera<hal::ColorCamera> color_camera(bool has_host_clock) {
  hal::LiveCamera<hal::ColorCamera> camera;
  camera.camera = std::make_unique<NoColor>();
  camera.width = 1280;
  camera.height = 720;
  camera.has_host_clock = has_host_clock;
  camera.buffers_bytes = 20;
  camera.description = "colour node";
  camera.notes = {"b"};
  return camera;
}

TEST(ComposeSensor, TwoNodesAreOneCamera) {
  const auto sensor = compose_sensor(depth_camera(true), color_camera(true), "");
  ASSERT_TRUE(sensor.has_value());
  EXPECT_TRUE(sensor->is_live);
  EXPECT_FALSE(sensor->has_two_clocks);
  EXPECT_EQ(sensor->buffers_bytes, 120u);
  EXPECT_EQ(sensor->description, "depth node; colour: colour node");
  ASSERT_EQ(sensor->notes.size(), 3u);
  EXPECT_NE(sensor->notes[2].find("assumed"), std::string::npos);
  EXPECT_TRUE(sensor->calibration.has_color);
  EXPECT_FALSE(sensor->calibration.registered);
  EXPECT_EQ(sensor->calibration.color.width, 1280);
  EXPECT_TRUE(sensor->depth && sensor->color);
}

TEST(ComposeSensor, ClocksAreOneOnlyWhenBothAreTheHosts) {
  EXPECT_TRUE(compose_sensor(depth_camera(false), color_camera(true), "")->has_two_clocks);
  EXPECT_TRUE(compose_sensor(depth_camera(true), color_camera(false), "")->has_two_clocks);
  EXPECT_FALSE(compose_sensor(depth_camera(false), std::nullopt, "")->has_two_clocks);
}

TEST(ComposeSensor, CalibrationFileIsReadAndChecked) {
  const test::TemporaryFolder folder;
  hal::RigCalibration wide = rig();
  wide.color.height = 360;
  wide.color.cy = 180;
  const std::string file = folder.write("rig.toml", hal::replay::format_calibration_toml(wide)).string();
  const auto sensor = compose_sensor(depth_camera(true), color_camera(true), file);
  ASSERT_TRUE(sensor.has_value()) << sensor.error().message;
  EXPECT_EQ(sensor->notes.size(), 2u);
  EXPECT_EQ(sensor->calibration.color.fx, 2 * wide.color.fx);
  EXPECT_EQ(sensor->calibration.T_color_depth.translation.x, wide.T_color_depth.translation.x);
  const std::string broken = folder.write("broken.toml", "format = 2\n").string();
  EXPECT_NE(compose_sensor(depth_camera(true), color_camera(true), broken).error().message.find("broken.toml"),
            std::string::npos);
  EXPECT_FALSE(compose_sensor(depth_camera(true), color_camera(true), "/absent.toml").has_value());
}

}  // namespace
}  // namespace tactus::firmware
