#include "hal/record/tac_writer.hpp"

#include <gtest/gtest.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <unistd.h>

#include <fstream>

#include "tests/hal/record/small_recording.hpp"

namespace tactus::hal::record {
namespace {

/// Every format of colour, however it is read.
TEST(TacWriter, EveryFormatComesBackByteForByte) {
  const test::TemporaryFolder folder;
  for (const PixelFormat format :
       {PixelFormat::rgb24, PixelFormat::yuyv, PixelFormat::nv12, PixelFormat::mjpeg}) {
    const auto path = folder.path() / (std::to_string(static_cast<int>(format)) + ".tac");
    record(path, {.color = format});
    for (const std::size_t prefetch : {std::size_t{0}, std::size_t{3}}) {
      auto sensor = open_tac(path, {.prefetch = prefetch});
      ASSERT_TRUE(sensor) << sensor.error().message;
      const Played played = play(*sensor);
      ASSERT_EQ(played.depth.size(), 9U);
      ASSERT_EQ(played.color.size(), 9U);
      for (std::uint64_t i = 0; i < 9; ++i) {
        EXPECT_TRUE(played.raw[0][i] == depth_frame(i)) << i;
        EXPECT_TRUE(played.raw[1][i] == color_frame(format, i)) << i;
        std::vector<std::uint16_t> depth(kPixels);
        ASSERT_EQ(frames::to_depth(depth_frame(i).raw(), depth), rt::Status::ok);
        EXPECT_EQ(played.depth[i], depth);
        Bytes rgb(3 * kPixels);
        ASSERT_EQ(frames::to_rgb(color_frame(format, i).raw(), rgb), rt::Status::ok);
        EXPECT_EQ(played.color[i], rgb) << "format " << static_cast<int>(format) << " frame " << i;
        EXPECT_EQ(played.depth_headers[i].arrived, header_of(i).arrived);
        EXPECT_EQ(played.color_headers[i].time, header_of(i, 3'000'000).time);
      }
      EXPECT_EQ(sensor->allocates_in_read, format == PixelFormat::mjpeg && prefetch == 0);
      EXPECT_GT(sensor->buffers_bytes, prefetch * kPixels * 9);
    }
  }
}

TEST(TacWriter, WhatIsKnownOfTheSensorComesBack) {
  const test::TemporaryFolder folder;
  const auto path = folder.path() / "a.tac";
  Sensor sensor = described_sensor();
  add_truth(sensor, 5000);  // more than one chunk of poses
  sensor.is_live = true;
  sensor.has_two_clocks = true;
  const TacInfo info{{{"source", "live:/dev/video0"}, {"command", "tactus record x"}}};
  auto writer = TacWriter::create(path, sensor, info, {});
  ASSERT_TRUE(writer) << writer.error().message;
  (*writer)->take(Stream::depth, depth_frame(0).raw());
  ASSERT_TRUE((*writer)->close());
  const auto facts = tac_facts(path);
  ASSERT_TRUE(facts) << facts.error().message;
  EXPECT_EQ(facts->info, info);
  EXPECT_TRUE(facts->was_live);
  EXPECT_TRUE(facts->has_two_clocks);
  EXPECT_EQ(facts->poses_count, 5000U);
  EXPECT_EQ(facts->description, sensor.description);
  EXPECT_EQ(facts->gravity_depth, sensor.gravity_depth);
  const auto opened = open_tac(path, {});
  ASSERT_TRUE(opened) << opened.error().message;
  EXPECT_FALSE(opened->is_live) << "a recording has an end";
  EXPECT_TRUE(opened->has_two_clocks);
  EXPECT_EQ(opened->calibration.depth, sensor.calibration.depth);
  EXPECT_EQ(opened->calibration.depth_m_per_unit, sensor.calibration.depth_m_per_unit);
  ASSERT_EQ(opened->truth.size(), sensor.truth.size());
  for (std::size_t i = 0; i < sensor.truth.size(); ++i) {
    ASSERT_EQ(opened->truth[i].time, sensor.truth[i].time);
    ASSERT_EQ(opened->truth[i].T_world_depth.rotation.m, sensor.truth[i].T_world_depth.rotation.m);
    ASSERT_EQ(opened->truth[i].T_world_depth.translation, sensor.truth[i].T_world_depth.translation);
  }
  EXPECT_EQ(opened->color, nullptr) << "no colour frame came";
  EXPECT_FALSE(opened->calibration.has_color);
}

TEST(TacWriter, PaddingBetweenRowsIsLeftOut) {
  const test::TemporaryFolder folder;
  const auto path = folder.path() / "a.tac";
  auto writer = TacWriter::create(path, described_sensor(), {}, {});
  ASSERT_TRUE(writer);
  for (const PixelFormat format : {PixelFormat::depth16, PixelFormat::rgb24, PixelFormat::yuyv, PixelFormat::nv12}) {
    const bool is_depth = format == PixelFormat::depth16;
    const auto number = static_cast<std::uint64_t>(format);
    const OwnedFrame packed = is_depth ? depth_frame(number) : color_frame(format, number);
    OwnedFrame padded = packed;
    padded.row_bytes += 10;
    padded.bytes.clear();
    for (std::size_t at = 0; at < packed.bytes.size(); at += packed.row_bytes) {
      padded.bytes.insert(padded.bytes.end(), packed.bytes.begin() + static_cast<std::ptrdiff_t>(at),
                          packed.bytes.begin() + static_cast<std::ptrdiff_t>(at + packed.row_bytes));
      padded.bytes.insert(padded.bytes.end(), 10, 0xEE);
    }
    padded.bytes.resize(padded.bytes.size() - 10);
    (*writer)->take(is_depth ? Stream::depth : Stream::color, padded.raw());
  }
  ASSERT_TRUE((*writer)->close());
  auto sensor = open_tac(path, {});
  ASSERT_TRUE(sensor) << sensor.error().message;
  const Played played = play(*sensor);
  ASSERT_EQ(played.raw[0].size(), 1U);
  EXPECT_TRUE(played.raw[0][0] == depth_frame(0));
  ASSERT_EQ(played.raw[1].size(), 3U);
  for (std::uint64_t i = 1; i <= 3; ++i)
    EXPECT_TRUE(played.raw[1][i - 1] == color_frame(static_cast<PixelFormat>(i), i));
}

TEST(TacWriter, JpegByChoiceIsWhatTheEncoderGives) {
  const test::TemporaryFolder folder;
  for (const PixelFormat format :
       {PixelFormat::rgb24, PixelFormat::yuyv, PixelFormat::nv12, PixelFormat::mjpeg}) {
    const auto path = folder.path() / (std::to_string(static_cast<int>(format)) + ".tac");
    record(path, {.frames_count = 3, .color = format}, {.color = TacColor::jpeg, .jpeg_quality = 70});
    auto sensor = open_tac(path, {});
    ASSERT_TRUE(sensor) << sensor.error().message;
    const Played played = play(*sensor);
    ASSERT_EQ(played.raw[1].size(), 3U);
    for (std::uint64_t i = 0; i < 3; ++i) {
      const OwnedFrame frame = color_frame(format, i);
      Bytes expected = frame.bytes;
      if (format != PixelFormat::mjpeg) {
        Bytes rgb(3 * kPixels);
        ASSERT_EQ(frames::to_rgb(frame.raw(), rgb), rt::Status::ok);
        ASSERT_TRUE(frames::encode_jpeg(rgb, kWidth, kHeight, 70, expected));
      }
      EXPECT_EQ(played.raw[1][i].format, PixelFormat::mjpeg);
      EXPECT_EQ(played.raw[1][i].bytes, expected);
      EXPECT_TRUE(played.raw[0][i] == depth_frame(i)) << "depth stays lossless";
    }
  }
}

TEST(TacWriter, FramesThatAreNotTheCamerasAreRefusedAndCounted) {
  const test::TemporaryFolder folder;
  const auto path = folder.path() / "a.tac";
  auto writer = TacWriter::create(path, described_sensor(false), {}, {});
  ASSERT_TRUE(writer);
  const OwnedFrame good = depth_frame(0);
  RawFrame frame = good.raw();
  (*writer)->take(Stream::depth, frame);
  frame.width /= 2;
  (*writer)->take(Stream::depth, frame);
  frame = good.raw();
  frame.bytes = frame.bytes.first(frame.bytes.size() - 1);
  (*writer)->take(Stream::depth, frame);
  (*writer)->take(Stream::depth, color_frame(PixelFormat::yuyv, 0).raw());
  (*writer)->take(Stream::color, color_frame(PixelFormat::rgb24, 0).raw());
  ASSERT_TRUE((*writer)->close());
  const auto counts = (*writer)->was();
  EXPECT_EQ(counts.streams[0], (EndCounts::OfStream{1, 0, 3}));
  EXPECT_EQ(counts.streams[1], (EndCounts::OfStream{0, 0, 1})) << "this sensor has no colour camera";
  const auto facts = tac_facts(path);
  ASSERT_TRUE(facts);
  EXPECT_EQ(facts->streams[0].frames, 1U);
  EXPECT_EQ(facts->streams[0].refused, 3U);
  const auto sensor = open_tac(path, {});
  ASSERT_TRUE(sensor);
  ASSERT_EQ(sensor->notes.size(), 1U);
  EXPECT_NE(sensor->notes[0].find("left out 3 depth and 1 colour"), std::string::npos) << sensor->notes[0];
}

/// Frames come a hundred times as fast as they can be written.
TEST(TacWriter, FullRingDropsCountsAndSaysSoInTheFile) {
  const test::TemporaryFolder folder;
  const auto path = folder.path() / "a.tac";
  Sensor sensor = described_sensor(false);
  sensor.calibration.depth.width = 640;
  sensor.calibration.depth.height = 480;
  constexpr std::uint64_t kFrames = 60;
  auto writer = TacWriter::create(path, sensor, {}, {.frames_waiting = 2});
  ASSERT_TRUE(writer);
  EXPECT_LT((*writer)->buffers_bytes(), std::size_t{16} << 20);
  const auto depth = depth_picture(DepthKind::noise, 640, 480, 1);
  for (std::uint64_t i = 0; i < kFrames; ++i)
    (*writer)->take(Stream::depth, frames::raw_frame(depth, header_of(i), 640, 480));
  ASSERT_TRUE((*writer)->close());
  const auto counts = (*writer)->was().streams[0];
  EXPECT_EQ(counts.written + counts.dropped, kFrames);
  EXPECT_GT(counts.written, 0U);
  EXPECT_GT(counts.dropped, 0U);
  const auto facts = tac_facts(path);
  ASSERT_TRUE(facts);
  EXPECT_EQ(facts->streams[0].frames, counts.written);
  EXPECT_EQ(facts->streams[0].dropped, counts.dropped);
}

TEST(TacWriter, WaitingDropsNothing) {
  const test::TemporaryFolder folder;
  const auto path = folder.path() / "a.tac";
  record(path, {.frames_count = 400, .has_labels = true}, {.frames_waiting = 1});
  const auto facts = tac_facts(path);
  ASSERT_TRUE(facts);
  EXPECT_EQ(facts->streams[0].frames, 400U);
  EXPECT_EQ(facts->streams[1].frames, 400U);
  EXPECT_EQ(facts->labels_count, 400U);
  EXPECT_EQ(facts->streams[0].missing + facts->streams[0].dropped, 0U);
}

TEST(TacWriter, AfterTheEndFramesAreOnlyCounted) {
  const test::TemporaryFolder folder;
  const auto path = folder.path() / "a.tac";
  auto writer = TacWriter::create(path, described_sensor(), {}, {.waits_when_full = true});
  ASSERT_TRUE(writer);
  (*writer)->take(Stream::depth, depth_frame(0).raw());
  EXPECT_FALSE((*writer)->has_stopped());
  ASSERT_TRUE((*writer)->close());
  EXPECT_TRUE((*writer)->has_stopped());
  const auto bytes = std::filesystem::file_size(path);
  (*writer)->take(Stream::depth, depth_frame(1).raw());
  EXPECT_FALSE((*writer)->add_labels(1, labels_of(1)));
  ASSERT_TRUE((*writer)->close()) << "says the same again";
  EXPECT_EQ((*writer)->was().streams[0], (EndCounts::OfStream{1, 1, 0}));
  writer = rt::Error{};
  EXPECT_EQ(std::filesystem::file_size(path), bytes);
}

TEST(TacWriter, LeavingWithoutCloseClosesToo) {
  const test::TemporaryFolder folder;
  const auto path = folder.path() / "a.tac";
  {
    auto writer = TacWriter::create(path, described_sensor(), {}, {});
    ASSERT_TRUE(writer);
    (*writer)->take(Stream::depth, depth_frame(0).raw());
  }
  const auto facts = tac_facts(path);
  ASSERT_TRUE(facts);
  EXPECT_FALSE(facts->is_cut_off);
  EXPECT_EQ(facts->streams[0].frames, 1U);
}

TEST(TacWriter, ExistingFilesAndMissingFoldersAreRefusedInOneSentence) {
  const test::TemporaryFolder folder;
  const auto path = folder.write("a.tac", "precious");
  const auto existing = TacWriter::create(path, described_sensor(), {}, {});
  ASSERT_FALSE(existing);
  EXPECT_EQ(existing.error().code, rt::ExitCode::bad_usage);
  EXPECT_EQ(folder.read("a.tac"), "precious");
  const auto missing = TacWriter::create(folder.path() / "no/b.tac", described_sensor(), {}, {});
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, rt::ExitCode::failed);
  EXPECT_NE(missing.error().message.find("b.tac"), std::string::npos);
}

/// Until the disk is full: the recording stops with a sentence, take() goes on counting, and the file plays.
void expect_graceful_end(const std::filesystem::path& path, const char* reason) {
  auto writer = TacWriter::create(path, described_sensor(), {}, {.waits_when_full = true});
  ASSERT_TRUE(writer) << writer.error().message;
  std::uint64_t taken = 0;
  while (!(*writer)->has_stopped() && taken < 100'000) {
    (*writer)->take(Stream::depth, depth_frame(taken).raw());
    (*writer)->take(Stream::color, color_frame(PixelFormat::rgb24, taken).raw());
    ++taken;
  }
  ASSERT_LT(taken, 100'000U) << "the disk never filled";
  (*writer)->take(Stream::depth, depth_frame(taken++).raw());
  const auto closed = (*writer)->close();
  ASSERT_FALSE(closed);
  const std::string& sentence = closed.error().message;
  EXPECT_EQ(sentence.rfind(path.string() + ": cannot be written any further (" + reason + ")", 0), 0U) << sentence;
  EXPECT_EQ(sentence.find('\n'), std::string::npos);
  const auto counts = (*writer)->was().streams[0];
  EXPECT_EQ(counts.written + counts.dropped, taken);
  auto sensor = open_tac(path, {});
  ASSERT_TRUE(sensor) << sensor.error().message;
  const Played played = play(*sensor);
  EXPECT_EQ(played.raw[0].size(), counts.written);
  EXPECT_GT(counts.written, 10U);
  for (std::size_t i = 0; i < played.raw[0].size(); ++i) ASSERT_TRUE(played.raw[0][i] == depth_frame(i)) << i;
  EXPECT_EQ(played.counters[0].frames_rejected, 0U);
}

TEST(TacWriter, FileSizeLimitStopsTheRecordingAndKeepsTheFile) {
  const test::TemporaryFolder folder;
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  rlimit small = before;
  small.rlim_cur = 300'001;
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  expect_graceful_end(folder.path() / "a.tac", "File too large");
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
}

TEST(TacWriter, FullDiskStopsTheRecordingAndKeepsTheFile) {
  const test::TemporaryFolder folder;
  if (mount("tactus", folder.path().c_str(), "tmpfs", 0, "size=400k") != 0)
    GTEST_SKIP() << "only root may mount the small disk that this test fills";
  expect_graceful_end(folder.path() / "a.tac", "No space left on device");
  EXPECT_EQ(umount2(folder.path().c_str(), MNT_DETACH), 0);
}

}  // namespace
}  // namespace tactus::hal::record
