#include "hal/replay/recording_writer.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "hal/replay/replay.hpp"
#include "tests/hal/replay/recording_folder.hpp"

namespace tactus::hal::replay {
namespace {

Sensor open(const std::filesystem::path& folder) {
  auto sensor = open_replay(folder, {});
  EXPECT_TRUE(sensor.has_value()) << (sensor ? "" : sensor.error().message);
  if (!sensor) std::abort();
  return std::move(*sensor);
}

void write(const std::filesystem::path& to, const std::filesystem::path& from,
           const RecordingOptions& options) {
  Sensor source = open(from);
  auto count = write_recording(to, source, options);
  ASSERT_TRUE(count.has_value()) << count.error().message;
  EXPECT_EQ(*count, source.depth->counters().frames_delivered);
}

void expect_same_frames(const Played& a, const Played& b) {
  EXPECT_EQ(a.depth, b.depth);
  EXPECT_EQ(a.color, b.color);
  ASSERT_EQ(a.headers.size(), b.headers.size());
  for (std::size_t i = 0; i < a.headers.size(); ++i) EXPECT_EQ(a.headers[i].time, b.headers[i].time);
}

constexpr const char* kOwnColorCamera =
    "format = 1\nregistered = false\n"
    "[depth]\nwidth = 40\nheight = 30\nfx = 35\nfy = 35\ncx = 19.5\ncy = 14.5\nm_per_unit = 0.0002\n"
    "[color]\nwidth = 40\nheight = 30\nfx = 36.1\nfy = 36.2\ncx = 19.25\ncy = 14.1\ndistortion = [0.1, -0.2, "
    "1e-3, 0, 0.05]\n"
    "[color.from_depth]\nrotation = [0, -1, 0, 1, 0, 0, 0, 0, 1]\ntranslation_m = [-0.03, 0.005, 0.001]\n";

TEST(RecordingWriter, TumCopyIsTheSameRecording) {
  const RecordingFolder source(7);
  source.write("calibration.toml", kOwnColorCamera);
  source.write("gravity.txt", "0.1 0.9 0.2\n");
  const test::TemporaryFolder target;
  write(target.path() / "copy", source.path(), {.color = ColorEncoding::png});
  Sensor a = open(source.path()), b = open(target.path() / "copy");
  expect_same_frames(play_depth(a), play_depth(b));
  expect_same_frames(play_color(a), play_color(b));
  EXPECT_EQ(a.calibration.depth, b.calibration.depth);
  EXPECT_EQ(a.calibration.color, b.calibration.color);
  EXPECT_EQ(a.calibration.depth_m_per_unit, b.calibration.depth_m_per_unit);
  EXPECT_EQ(a.calibration.registered, b.calibration.registered);
  EXPECT_EQ(a.calibration.T_color_depth.rotation.m, b.calibration.T_color_depth.rotation.m);
  EXPECT_EQ(a.calibration.T_color_depth.translation, b.calibration.T_color_depth.translation);
  ASSERT_TRUE(b.gravity_depth.has_value());
  EXPECT_NEAR((*a.gravity_depth - *b.gravity_depth).norm(), 0, 1e-15);
  ASSERT_EQ(a.truth.size(), b.truth.size());
  for (std::size_t i = 0; i < a.truth.size(); ++i) {
    EXPECT_EQ(a.truth[i].time, b.truth[i].time);
    EXPECT_EQ(a.truth[i].T_world_depth.translation, b.truth[i].T_world_depth.translation);
  }
  std::vector<std::uint8_t> ids_a(kPixels), ids_b(kPixels);
  for (std::uint64_t i = 0; i < 7; ++i) {
    ASSERT_EQ(a.labels->read(i, ids_a), rt::Status::ok);
    ASSERT_EQ(b.labels->read(i, ids_b), rt::Status::ok);
    EXPECT_EQ(ids_a, ids_b);
  }
}

TEST(RecordingWriter, SecondCopyHasTheSameBytes) {
  const RecordingFolder source(3);
  const test::TemporaryFolder target;
  write(target.path() / "one", source.path(), {});
  write(target.path() / "two", target.path() / "one", {.color = ColorEncoding::png});
  write(target.path() / "three", target.path() / "two", {.color = ColorEncoding::png});
  for (const char* file : {"depth.txt", "rgb.txt", "label.txt", "groundtruth.txt", "intrinsics.txt",
                           "depth/000002.png", "rgb/000001.png", "label/000000.png"})
    EXPECT_EQ(target.read(std::filesystem::path("two") / file),
              target.read(std::filesystem::path("three") / file))
        << file;
  EXPECT_FALSE(std::filesystem::exists(target.path() / "two/calibration.toml"))
      << "registered: intrinsics.txt says it all";
}

TEST(RecordingWriter, SevenScenesAndBackKeepsMillimetresExactly) {
  const RecordingFolder source(6);
  source.write("intrinsics.txt", "35 35 19.5 14.5 40 30 1000\n");
  source.write("gravity.txt", "0 0.8 0.6\n");
  const test::TemporaryFolder target;
  const auto seven = target.path() / "seven", back = target.path() / "back";
  write(seven, source.path(), {.layout = RecordingLayout::seven_scenes, .color = ColorEncoding::png});
  write(back, seven, {.color = ColorEncoding::png});
  Sensor a = open(source.path()), b = open(seven), c = open(back);
  const Played depth = play_depth(a);
  EXPECT_EQ(play_depth(b).depth, depth.depth);
  const Played depth_back = play_depth(c);
  EXPECT_EQ(depth_back.depth, depth.depth);
  EXPECT_EQ(depth_back.headers[4].time.ns, 4'000'000'000 / 30);
  EXPECT_EQ(play_color(c).color, play_color(a).color);
  EXPECT_EQ(c.calibration.depth, a.calibration.depth);
  EXPECT_TRUE(c.calibration.registered);
  EXPECT_EQ(c.truth.size(), 6U);
  EXPECT_EQ(c.truth[3].T_world_depth.translation.x, 3);
  EXPECT_EQ(c.gravity_depth, a.gravity_depth);
  EXPECT_TRUE(b.notes.empty() && c.notes.empty());
  std::vector<std::uint8_t> ids(kPixels);
  ASSERT_EQ(c.labels->read(2, ids), rt::Status::ok);
  EXPECT_EQ(ids, bytes_image(kPixels, 2002, 23));
}

TEST(RecordingWriter, OtherUnitsAreRoundedToMillimetres) {
  const RecordingFolder source(1);  // 1/5000 m
  const test::TemporaryFolder target;
  write(target.path() / "seven", source.path(), {.layout = RecordingLayout::seven_scenes});
  Sensor sut = open(target.path() / "seven");
  const auto raw = depth_image(0), mm = play_depth(sut).depth.at(0);
  for (std::size_t i = 0; i < kPixels; ++i) EXPECT_NEAR(mm[i], raw[i] / 5.0, 0.5) << i;
}

TEST(RecordingWriter, RejectedFramesAreLeftOut) {
  const RecordingFolder source(4);
  source.write("depth/1.png", "spoilt");
  const test::TemporaryFolder target;
  write(target.path() / "copy", source.path(), {.color = ColorEncoding::png});
  Sensor sut = open(target.path() / "copy");
  EXPECT_EQ(play_depth(sut).counters.frames_delivered, 3U);
  EXPECT_EQ(play_color(sut).counters.frames_delivered, 4U);
}

TEST(RecordingWriter, CutShortCanBeReadUpToThere) {
  const RecordingFolder source(6);
  const test::TemporaryFolder target;
  Sensor from = open(source.path());
  auto writer = RecordingWriter::open(target.path() / "cut", from, {});
  ASSERT_TRUE(writer.has_value());
  for (int i = 0; i < 3; ++i) {
    auto more = writer->step();
    ASSERT_TRUE(more.has_value() && *more);
  }
  Sensor sut = open(target.path() / "cut");
  EXPECT_EQ(play_depth(sut).depth.size(), 3U);
}

TEST(RecordingWriter, FullFolderIsNotTouched) {
  const RecordingFolder source(1);
  Sensor from = open(source.path());
  auto writer = RecordingWriter::open(source.path(), from, {});
  ASSERT_FALSE(writer.has_value());
  EXPECT_EQ(writer.error().code, rt::ExitCode::bad_usage);
  EXPECT_EQ(writer.error().message,
            source.path().string() + ": exists and is not empty; name a new folder for the recording");
}

}  // namespace
}  // namespace tactus::hal::replay
