#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>

#include "hal/replay/replay.hpp"
#include "tests/hal/replay/counted_new.hpp"
#include "tests/hal/replay/recording_folder.hpp"

namespace tactus::hal::replay {
namespace {

Sensor open(const RecordingFolder& folder, const ReplayOptions& options = {}) {
  auto sensor = open_replay(folder.path(), options);
  EXPECT_TRUE(sensor.has_value()) << (sensor ? "" : sensor.error().message);
  if (!sensor) std::abort();
  return std::move(*sensor);
}

/// The message with the folder's own path left out.
std::string error_of(const std::filesystem::path& folder, const ReplayOptions& options = {},
                     rt::ExitCode code = rt::ExitCode::bad_input) {
  auto sensor = open_replay(folder, options);
  if (sensor) return "opened";
  EXPECT_EQ(sensor.error().code, code);
  std::string message = sensor.error().message;
  const std::string prefix = folder.string();
  for (std::size_t at = message.find(prefix); at != std::string::npos; at = message.find(prefix))
    message.replace(at, prefix.size() + (message[at + prefix.size()] == '/' ? 1 : 0), "");
  return message;
}

std::string error_of(const RecordingFolder& folder) { return error_of(folder.path()); }

std::string relative(const RecordingFolder& folder, const std::string& sentence) {
  EXPECT_TRUE(sentence.starts_with(folder.path().string() + "/")) << sentence;
  return sentence.substr(std::min(sentence.size(), folder.path().string().size() + 1));
}

TEST(OpenReplay, TumFolderGivesEveryFrameAsRecorded) {
  const RecordingFolder folder(5);
  Sensor sut = open(folder);
  EXPECT_EQ(sut.frames_count, 5U);
  EXPECT_EQ(sut.truth.size(), 5U);
  EXPECT_TRUE(sut.calibration.registered);
  EXPECT_TRUE(sut.calibration.has_color);
  EXPECT_NEAR(sut.frame_rate_hz, 30, 0.31);
  EXPECT_EQ(sut.gravity_depth, std::nullopt);
  EXPECT_TRUE(sut.notes.empty());
  const Played depth = play_depth(sut), color = play_color(sut);
  ASSERT_EQ(depth.depth.size(), 5U);
  ASSERT_EQ(color.color.size(), 5U);
  for (unsigned i = 0; i < 5; ++i) {
    EXPECT_EQ(depth.depth[i], depth_image(i));
    EXPECT_EQ(color.color[i], bytes_image(kPixels * 3, 1000 + i));
    EXPECT_EQ(depth.headers[i].sequence, i);
    EXPECT_EQ(depth.headers[i].time.ns, 100'000'000'000 + i * 33'000'000);
    EXPECT_EQ(color.headers[i].time.ns, 100'003'000'000 + i * 33'000'000);
  }
  ASSERT_NE(sut.labels, nullptr);
  std::vector<std::uint8_t> ids(kPixels);
  ASSERT_EQ(sut.labels->read(3, ids), rt::Status::ok);
  EXPECT_EQ(ids, bytes_image(kPixels, 2003, 23));
  EXPECT_EQ(sut.labels->read(5, ids), rt::Status::skipped);
}

TEST(OpenReplay, SaturatedDepthBecomesNoMeasurement) {
  const RecordingFolder folder(1);
  std::vector<std::uint16_t> depth(kPixels, 65535);
  depth[7] = 65534;
  ASSERT_TRUE(write_depth_png(folder.path() / "depth/0.png", depth, kWidth, kHeight));
  Sensor sut = open(folder);
  const Played played = play_depth(sut);
  ASSERT_EQ(played.depth.size(), 1U);
  EXPECT_EQ(played.depth[0][7], 65534);
  EXPECT_EQ(std::count(played.depth[0].begin(), played.depth[0].end(), 0),
            static_cast<std::ptrdiff_t>(kPixels) - 1);
}

TEST(OpenReplay, BlankDepthFrameIsDelivered) {
  const RecordingFolder folder(2);
  ASSERT_TRUE(
      write_depth_png(folder.path() / "depth/1.png", std::vector<std::uint16_t>(kPixels), kWidth, kHeight));
  Sensor sut = open(folder);
  EXPECT_EQ(play_depth(sut).counters.frames_delivered, 2U);
}

TEST(OpenReplay, DepthOnlyWorks) {
  const RecordingFolder folder(3);
  std::filesystem::remove(folder.path() / "rgb.txt");
  Sensor sut = open(folder);
  EXPECT_EQ(sut.color, nullptr);
  EXPECT_FALSE(sut.calibration.has_color);
  EXPECT_EQ(play_depth(sut).depth.size(), 3U);
}

TEST(OpenReplay, RangeTakesItsFramesAndTheirColour) {
  const RecordingFolder folder(10);
  Sensor sut = open(folder, {.first = 3, .last = 6});
  EXPECT_EQ(sut.frames_count, 3U);
  const Played depth = play_depth(sut), color = play_color(sut);
  ASSERT_EQ(depth.headers.size(), 3U);
  EXPECT_EQ(depth.headers[0].sequence, 3U);
  EXPECT_EQ(depth.depth[0], depth_image(3));
  ASSERT_EQ(color.headers.size(), 3U);
  EXPECT_EQ(color.headers[0].sequence, 3U);
  EXPECT_EQ(color.headers[2].sequence, 5U);
  std::vector<std::uint8_t> ids(kPixels);
  ASSERT_EQ(sut.labels->read(4, ids), rt::Status::ok);
  EXPECT_EQ(ids, bytes_image(kPixels, 2004, 23));
  EXPECT_EQ(sut.labels->read(7, ids), rt::Status::skipped);
}

TEST(OpenReplay, EmptyRangeIsBadUsage) {
  const RecordingFolder folder(4);
  for (const ReplayOptions& options :
       {ReplayOptions{.first = 4}, {.first = 2, .last = 2}, {.first = 3, .last = 1}})
    EXPECT_EQ(error_of(folder.path(), options, rt::ExitCode::bad_usage),
              ": no frame is in the range asked for; the recording has frames 0 to 3");
}

TEST(OpenReplay, PrefetchGivesTheSameFramesWithoutHeapCalls) {
  const RecordingFolder folder(12);
  folder.write("depth/4.png", "spoilt");
  folder.write("rgb/7.png", folder.read("rgb/7.png").substr(0, 500));
  Sensor plain = open(folder);
  const Played depth = play_depth(plain), color = play_color(plain);
  for (const std::size_t prefetch : {1U, 2U, 4U, 64U}) {
    Sensor sut = open(folder, {.prefetch = prefetch});
    std::vector<std::uint16_t> pixels(kPixels);
    std::vector<std::uint8_t> rgb(kPixels * 3);
    std::size_t good_count = 0, good_color_count = 0;
    for (std::size_t i = 0; i < depth.statuses.size(); ++i) {
      FrameHeader header, color_header;
      const std::uint64_t before = test::heap_calls_count();
      const rt::Status status = sut.depth->read(pixels, header, kLong);
      const rt::Status color_status = sut.color->read(rgb, color_header, kLong);
      EXPECT_EQ(test::heap_calls_count(), before);
      ASSERT_EQ(status, depth.statuses[i]);
      ASSERT_EQ(color_status, color.statuses[i]);
      if (status == rt::Status::ok) {
        EXPECT_EQ(pixels, depth.depth[good_count]);
        EXPECT_EQ(header.sequence, depth.headers[good_count].sequence);
        EXPECT_EQ(header.time, depth.headers[good_count++].time);
      }
      if (color_status == rt::Status::ok) {
        EXPECT_EQ(rgb, color.color[good_color_count++]);
      }
    }
    FrameHeader header;
    for (int again = 0; again < 3; ++again)
      EXPECT_EQ(sut.depth->read(pixels, header, kLong), rt::Status::end_of_stream);
    EXPECT_EQ(sut.depth->counters().first_rejection, depth.counters.first_rejection);
    EXPECT_EQ(sut.depth->counters().frames_rejected, 1U);
    EXPECT_EQ(sut.color->counters().frames_rejected, 1U);
  }
}

TEST(OpenReplay, PrefetchThreadEndsWithTheSensorAtAnyPoint) {
  const RecordingFolder folder(8);
  for (int reads = 0; reads < 10; ++reads) {
    Sensor sut = open(folder, {.prefetch = 2});
    std::vector<std::uint16_t> pixels(kPixels);
    FrameHeader header;
    for (int i = 0; i < reads; ++i)
      EXPECT_EQ(sut.depth->read(pixels, header, kLong), i < 8 ? rt::Status::ok : rt::Status::end_of_stream);
  }
}

TEST(ReplayFaults, SingleBadFramesAreCountedAndTheSessionGoesOn) {
  struct Case {
    const char* what;
    std::string bytes;
    const char* sentence;
  };
  const RecordingFolder source(1);
  const std::string good = source.read("depth/0.png");
  std::string huge = good;
  huge[16] = '\x40';
  const Case cases[] = {
      {"empty", "", "depth/1.png: the file is empty"},
      {"garbage", "garbage", "depth/1.png: neither PNG nor JPEG"},
      {"truncated", good.substr(0, good.size() / 2),
       "depth/1.png: a damaged PNG (the file ends before the image does)"},
      {"without end", good.substr(0, good.size() - 12),
       "depth/1.png: a damaged PNG (the file ends before the image does)"},
      {"8 bit", source.read("label/0.png"),
       "depth/1.png: a PNG of 8 bits and 1 channels; depth is a 16-bit greyscale PNG"},
      {"colour", source.read("rgb/0.png"),
       "depth/1.png: a PNG of 8 bits and 3 channels; depth is a 16-bit greyscale PNG"},
      {"absurd", huge, "depth/1.png: 1073741864x30 pixels, but the calibration says 40x30"},
  };
  for (const Case& c : cases) {
    SCOPED_TRACE(c.what);
    const RecordingFolder folder(3);
    folder.write("depth/1.png", c.bytes);
    Sensor sut = open(folder);
    const Played played = play_depth(sut);
    EXPECT_EQ(played.statuses, (std::vector{rt::Status::ok, rt::Status::corrupt, rt::Status::ok}));
    EXPECT_EQ(played.headers[1].sequence, 2U);
    EXPECT_EQ(played.counters.frames_rejected, 1U);
    EXPECT_EQ(played.counters.frames_delivered, 2U);
    EXPECT_EQ(relative(folder, played.counters.first_rejection), c.sentence);
  }
}

TEST(ReplayFaults, SizeThatChangesIsRejected) {
  const RecordingFolder folder(3);
  ASSERT_TRUE(write_depth_png(folder.path() / "depth/2.png", std::vector<std::uint16_t>(20 * 30, 7), 20, 30));
  Sensor sut = open(folder);
  const Played played = play_depth(sut);
  EXPECT_EQ(played.counters.frames_rejected, 1U);
  EXPECT_EQ(relative(folder, played.counters.first_rejection),
            "depth/2.png: 20x30 pixels, but the calibration says 40x30");
}

TEST(ReplayFaults, MissingAndUnreadableFilesAreCounted) {
  const RecordingFolder folder(4);
  std::filesystem::remove(folder.path() / "depth/0.png");
  std::filesystem::remove(folder.path() / "depth/2.png");
  std::filesystem::create_directory(folder.path() / "depth/2.png");
  Sensor sut = open(folder);
  const Played played = play_depth(sut);
  EXPECT_EQ(played.counters.frames_rejected, 2U);
  EXPECT_EQ(relative(folder, played.counters.first_rejection), "depth/0.png: the file is missing");
}

TEST(ReplayFaults, DeviceFilesAreNotOpened) {
  const RecordingFolder folder(2);
  folder.write("depth.txt", "1 /dev/zero\n2 depth/1.png\n");
  Sensor sut = open(folder);
  EXPECT_EQ(play_depth(sut).counters.first_rejection, "/dev/zero: not a regular file");
}

TEST(ReplayFaults, TimesOutOfOrderAreSkippedAndCounted) {
  const RecordingFolder folder(5);
  folder.write("depth.txt", "1 depth/0.png\n2 depth/1.png\n0.5 depth/2.png\n2 depth/3.png\n3 depth/4.png\n");
  Sensor sut = open(folder);
  const Played played = play_depth(sut);
  EXPECT_EQ(played.statuses, std::vector(3, rt::Status::ok));
  EXPECT_EQ(played.counters.timestamps_rejected, 2U);
  EXPECT_EQ(played.counters.frames_rejected, 0U);
  EXPECT_EQ(played.headers.back().sequence, 4U);
  EXPECT_EQ(relative(folder, played.counters.first_rejection),
            "depth.txt:3: the time of \"depth/2.png\" does not fit between its neighbours'");
}

TEST(ReplayFaults, GarbledListLinesAreCounted) {
  const RecordingFolder folder(3);
  folder.write("depth.txt", "1 depth/0.png\nNaN depth/1.png\n3 depth/2.png\n");
  Sensor sut = open(folder);
  const Played played = play_depth(sut);
  EXPECT_EQ(played.statuses, (std::vector{rt::Status::ok, rt::Status::corrupt, rt::Status::ok}));
  EXPECT_EQ(relative(folder, played.counters.first_rejection),
            "depth.txt:2: the line is not \"timestamp path\"");
}

TEST(ReplayFaults, PauseAndBadPosesAreNoted) {
  const RecordingFolder folder(3);
  folder.write("depth.txt", "1 depth/0.png\n2.5 depth/1.png\n2.6 depth/2.png\n");
  folder.write("groundtruth.txt", "1 0 0 0 0 0 0 1\n2 nan 0 0 0 0 0 1\n3 0 0 0 0 0 0 7\n");
  std::filesystem::remove(folder.path() / "rgb.txt");
  Sensor sut = open(folder);
  EXPECT_EQ(sut.truth.size(), 1U);
  ASSERT_EQ(sut.notes.size(), 2U);
  EXPECT_EQ(sut.notes[0], "2 true poses are left out: " + (folder.path() / "groundtruth.txt").string() +
                              ":2: needs 8 finite numbers: timestamp tx ty tz qx qy qz qw");
  EXPECT_EQ(relative(folder, sut.notes[1]),
            "depth.txt: time jumps forward 1 times by a second or more, first by 1.500000 s before frame 1");
}

TEST(ReplayFaults, WhatTheSessionCannotDoWithoutIsAnError) {
  {
    const test::TemporaryFolder folder;
    EXPECT_EQ(error_of(folder.path()),
              ": holds neither depth.txt (TUM RGB-D layout) nor frame-NNNNNN.depth.png (7-Scenes layout)");
    EXPECT_EQ(error_of(folder.path() / "none"), ": there is no such folder");
    folder.write("file", "x");
    EXPECT_EQ(error_of(folder.path() / "file"), ": not a folder");
  }
  const auto spoilt = [](const char* file, std::string_view bytes) {
    const RecordingFolder folder(3);
    folder.write(file, bytes);
    return error_of(folder);
  };
  EXPECT_EQ(spoilt("depth.txt", ""),
            "depth.txt: the list is empty; it must have one \"timestamp path\" line per frame");
  EXPECT_EQ(spoilt("rgb.txt", "\x01\x02"),
            "rgb.txt:1: \"??\" is not \"timestamp path\", and no other line is either");
  EXPECT_EQ(spoilt("label.txt", "#\n"),
            "label.txt: the list is empty; it must have one \"timestamp path\" line per frame");
  EXPECT_EQ(spoilt("intrinsics.txt", "35 35 19.5 14.5 80 30 5000\n"),
            "depth/0.png: 40x30 pixels, but the calibration says 80x30; none of the other 2 frames is usable "
            "either");
  EXPECT_EQ(spoilt("depth.txt", "1 nowhere.png\n"), "nowhere.png: the file is missing");
  EXPECT_EQ(spoilt("gravity.txt", "0 0 0\n"), "gravity.txt: the direction of gravity has no usable length");
  EXPECT_EQ(spoilt("calibration.toml",
                   "format = 1\nregistered = true\n[depth]\nwidth = 40\nheight = 30\nfx = 36\n"
                   "fy = 36\ncx = 19.5\ncy = 14.5\nm_per_unit = 0.0002\n"),
            "intrinsics.txt: says another depth camera than calibration.toml beside it; remove one");
  EXPECT_EQ(spoilt("calibration.toml",
                   "format = 1\nregistered = false\n[depth]\nwidth = 40\nheight = 30\nfx = 35\n"
                   "fy = 35\ncx = 19.5\ncy = 14.5\nm_per_unit = 0.0002\n"),
            ": holds colour images, but its calibration says nothing of the colour camera; add it or set "
            "registered");
  const RecordingFolder folder(1);
  std::filesystem::remove(folder.path() / "depth.txt");
  std::filesystem::create_directory(folder.path() / "depth.txt");
  EXPECT_EQ(error_of(folder), "depth.txt: not a regular file");
}

TEST(ReplayFaults, LabelsOfNoMaterialAreCorrupt) {
  const RecordingFolder folder(2);
  auto ids = bytes_image(kPixels, 1, 23);
  ids[3] = 255;
  ASSERT_TRUE(write_label_png(folder.path() / "label/0.png", ids, kWidth, kHeight));
  ids[3] = 23;
  ASSERT_TRUE(write_label_png(folder.path() / "label/1.png", ids, kWidth, kHeight));
  Sensor sut = open(folder);
  EXPECT_EQ(sut.labels->read(0, ids), rt::Status::ok);
  EXPECT_EQ(ids[3], 255);
  EXPECT_EQ(sut.labels->read(1, ids), rt::Status::corrupt);
}

TEST(ReplayGravity, OwnFileHoldsForTheFirstFrameAndTurnsWithThePoses) {
  const RecordingFolder folder(4);
  folder.write("gravity.txt", "0 2 0\n");
  // From frame 2 on the camera is rolled by a quarter turn about its optical axis.
  const auto time = [](unsigned i) { return RecordingFolder::time_text(i, 0); };
  folder.write("groundtruth.txt",
               time(0) + " 0 0 0 0 0 0 1\n" + time(2) + " 0 0 0 0 0 0.70710678 0.70710678\n");
  EXPECT_EQ(open(folder).gravity_depth, (Vec3d{0, 1, 0}));
  const auto turned = open(folder, {.first = 2}).gravity_depth;
  ASSERT_TRUE(turned.has_value());
  EXPECT_NEAR(turned->x, 1, 1e-7);
  EXPECT_NEAR(turned->y, 0, 1e-7);
  Sensor unknown = open(folder, {.first = 3});
  EXPECT_EQ(unknown.gravity_depth, std::nullopt);
  EXPECT_EQ(unknown.notes.size(), 1U);
}

TEST(SevenScenes, FramesTimesAndRangeFollowTheNumbers) {
  const RecordingFolder source(1);
  const test::TemporaryFolder folder;
  for (const unsigned i : {2U, 3U, 5U}) {
    const std::string stem = "frame-00000" + std::to_string(i);
    ASSERT_TRUE(write_depth_png(folder.path() / (stem + ".depth.png"), depth_image(i), kWidth, kHeight));
    if (i != 3) folder.write(stem + ".color.png", source.read("rgb/0.png"));
    folder.write(stem + ".pose.txt", i == 5 ? "nan" : "0 -1 0 1\n1 0 0 2\n0 0 1 3\n0 0 0 1\n");
  }
  folder.write("camera-intrinsics.txt", "35 0 19.5\n0 35 14.5\n0 0 1\n");
  folder.write("gravity-direction.txt", "1\n0\n0\n");
  auto sut = open_replay(folder.path(), {});
  ASSERT_TRUE(sut.has_value()) << sut.error().message;
  EXPECT_EQ(sut->calibration.depth_m_per_unit, 0.001);
  EXPECT_EQ(sut->calibration.depth.width, kWidth);
  const Played depth = play_depth(*sut), color = play_color(*sut);
  ASSERT_EQ(depth.headers.size(), 3U);
  EXPECT_EQ(depth.headers[2].sequence, 5U);
  EXPECT_EQ(depth.headers[2].time.ns, 166'666'666);
  EXPECT_EQ(depth.depth[1], depth_image(3));
  ASSERT_EQ(color.headers.size(), 2U);
  EXPECT_EQ(color.headers[1].time, depth.headers[2].time);
  EXPECT_EQ(sut->truth.size(), 2U);
  // World x is down; the first camera's y axis is minus the world's x axis.
  ASSERT_TRUE(sut->gravity_depth.has_value());
  EXPECT_NEAR(sut->gravity_depth->y, -1, 1e-12);
  EXPECT_EQ(sut->notes.size(), 3U) << "no calibration.txt, one bad pose, one frame without colour";
  auto part = open_replay(folder.path(), {.first = 3, .last = 5});
  ASSERT_TRUE(part.has_value()) << part.error().message;
  EXPECT_EQ(play_depth(*part).depth.size(), 1U);
  EXPECT_EQ(part->color, nullptr);
}

TEST(SevenScenes, UnknownSizeWithoutIntrinsicsIsAnError) {
  const test::TemporaryFolder folder;
  ASSERT_TRUE(write_depth_png(folder.path() / "frame-000000.depth.png", depth_image(0), kWidth, kHeight));
  EXPECT_EQ(error_of(folder.path()),
            "frame-000000.depth.png: 40x30 pixels, but the calibration says 640x480");
}

}  // namespace
}  // namespace tactus::hal::replay
