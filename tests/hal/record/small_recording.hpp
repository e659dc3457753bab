// A small sensor's frames with their exact bytes, and recordings made of them.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <random>
#include <string>
#include <vector>

#include "hal/frames/convert.hpp"
#include "hal/frames/jpeg_codec.hpp"
#include "hal/record/tac.hpp"
#include "hal/record/tac_writer.hpp"
#include "tests/hal/record/depth_pictures.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tactus::hal::record {

using Bytes = std::vector<std::uint8_t>;

/// Even sizes: yuyv and nv12 need pairs.
inline constexpr int kWidth = 40, kHeight = 30;
inline constexpr std::size_t kPixels = kWidth * kHeight;
inline constexpr rt::Duration kLong{10'000'000'000};

/// What a writer needs to know of a sensor. No cameras.
inline Sensor described_sensor(bool has_color = true) {
  Sensor out;
  out.description = "a small sensor";
  RigCalibration& rig = out.calibration;
  rig.depth = {kWidth, kHeight, 35.5, 35.25, 19.5, 14.5, 0.01, -0.02, 0.0003, 0.0004, 0.1};
  rig.depth_m_per_unit = 0.0002;
  rig.has_color = has_color;
  if (has_color) {
    rig.color = {kWidth, kHeight, 36, 36, 20, 15, 0, 0, 0, 0, 0};
    rig.T_color_depth.translation = {-0.025, 0.001, 0};
  }
  out.frame_rate_hz = 30;
  out.gravity_depth = Vec3d{0, 1, 0};
  return out;
}

/// A raw frame that owns its bytes.
struct OwnedFrame {
  FrameHeader header;
  PixelFormat format = PixelFormat::depth16;
  std::size_t row_bytes = 0;
  Bytes bytes;

  [[nodiscard]] RawFrame raw() const { return {header, format, kWidth, kHeight, row_bytes, bytes}; }
  friend bool operator==(const OwnedFrame& a, const OwnedFrame& b) {
    return a.header.time == b.header.time && a.header.sequence == b.header.sequence &&
           a.header.arrived == b.header.arrived && a.format == b.format && a.row_bytes == b.row_bytes &&
           a.bytes == b.bytes;
  }
};

/// 100 s + i / 30 Hz; colour 3 ms later. Arrived 5 ms after that on a clock that began a day before.
inline FrameHeader header_of(std::uint64_t i, std::int64_t later_ns = 0) {
  const std::int64_t ns = 100'000'000'000 + static_cast<std::int64_t>(i) * 33'333'333 + later_ns;
  return {{ns}, i, {ns + 86'400'000'000'000 + 5'000'000}};
}

inline OwnedFrame depth_frame(std::uint64_t i) {
  const auto kind = i % 3 == 0 ? DepthKind::disparity : i % 3 == 1 ? DepthKind::saturated : DepthKind::noise;
  auto depth = depth_picture(kind, kWidth, kHeight, static_cast<unsigned>(i) + 1);
  Bytes bytes(2 * depth.size());
  std::memcpy(bytes.data(), depth.data(), bytes.size());
  return {header_of(i), PixelFormat::depth16, 2 * kWidth, std::move(bytes)};
}

inline OwnedFrame color_frame(PixelFormat format, std::uint64_t i) {
  std::mt19937 random(static_cast<unsigned>(i) + 1000);
  Bytes bytes(frames::packed_bytes(format == PixelFormat::mjpeg ? PixelFormat::rgb24 : format, kWidth, kHeight));
  for (std::size_t k = 0; k < bytes.size(); ++k)
    bytes[k] = static_cast<std::uint8_t>(i % 2 == 0 ? random() : k / 7 + random() % 4);
  std::size_t row_bytes = bytes.size() / kHeight;
  if (format == PixelFormat::nv12) row_bytes = kWidth;
  if (format == PixelFormat::mjpeg) {
    Bytes jpeg;
    EXPECT_TRUE(frames::encode_jpeg(bytes, kWidth, kHeight, 80, jpeg));
    bytes = std::move(jpeg);
    row_bytes = 0;
  }
  return {header_of(i, 3'000'000), format, row_bytes, std::move(bytes)};
}

inline Bytes labels_of(std::uint64_t i) {
  Bytes ids(kPixels);
  for (std::size_t k = 0; k < ids.size(); ++k)
    ids[k] = static_cast<std::uint8_t>((k / 50 + i) % 24 == 23 ? 255 : (k / 50 + i) % 24);
  return ids;
}

inline void add_truth(Sensor& sensor, std::uint64_t count) {
  for (std::uint64_t i = 0; i < count; ++i) {
    TruthPose pose;
    pose.time = header_of(i).time;
    const double turn = 0.01 * static_cast<double>(i);
    pose.T_world_depth.rotation = Rotation::from(Quaternion{1, turn, 0, 0.3 * turn}.normalized());
    pose.T_world_depth.translation = {0.1 * static_cast<double>(i), -0.0, 1.0 / 3};
    sensor.truth.push_back(pose);
  }
}

struct Content {
  std::uint64_t frames_count = 9;
  PixelFormat color = PixelFormat::rgb24;
  bool has_color = true, has_labels = true, has_truth = true;
};

/// `path`, written whole. Nothing is dropped.
inline void record(const std::filesystem::path& path, const Content& content, TacOptions options = {}) {
  Sensor sensor = described_sensor(content.has_color);
  if (content.has_truth) add_truth(sensor, content.frames_count);
  options.waits_when_full = true;
  auto writer = TacWriter::create(path, sensor, {{{"source", "a test"}}}, options);
  ASSERT_TRUE(writer) << writer.error().message;
  for (std::uint64_t i = 0; i < content.frames_count; ++i) {
    (*writer)->take(Stream::depth, depth_frame(i).raw());
    if (content.has_color) (*writer)->take(Stream::color, color_frame(content.color, i).raw());
    if (content.has_labels) {
      ASSERT_TRUE((*writer)->add_labels(i, labels_of(i)));
    }
  }
  const auto closed = (*writer)->close();
  ASSERT_TRUE(closed) << closed.error().message;
}

/// Keeps what it is shown.
class Keeper final : public FrameTap {
 public:
  void take(Stream stream, const RawFrame& frame) noexcept override {
    frames[static_cast<std::size_t>(stream)].push_back(
        {frame.header, frame.format, frame.row_bytes, Bytes(frame.bytes.begin(), frame.bytes.end())});
  }
  std::array<std::vector<OwnedFrame>, 2> frames;
};

/// A recording played to its end, with raw forms.
struct Played {
  std::vector<FrameHeader> depth_headers, color_headers;
  std::vector<std::vector<std::uint16_t>> depth;
  std::vector<Bytes> color;
  std::array<std::vector<OwnedFrame>, 2> raw;
  std::array<CameraCounters, 2> counters;
};

inline Played play(Sensor& sensor) {
  Played out;
  Keeper keeper;
  sensor.depth->set_tap(&keeper);
  FrameHeader header;
  std::vector<std::uint16_t> depth(kPixels);
  for (;;) {
    const rt::Status status = sensor.depth->read(depth, header, kLong);
    if (status == rt::Status::end_of_stream) break;
    if (status != rt::Status::ok) continue;
    out.depth_headers.push_back(header);
    out.depth.push_back(depth);
  }
  out.counters[0] = sensor.depth->counters();
  sensor.depth->set_tap(nullptr);
  if (sensor.color) {
    sensor.color->set_tap(&keeper);
    Bytes rgb(3 * kPixels);
    for (;;) {
      const rt::Status status = sensor.color->read(rgb, header, kLong);
      if (status == rt::Status::end_of_stream) break;
      if (status != rt::Status::ok) continue;
      out.color_headers.push_back(header);
      out.color.push_back(rgb);
    }
    out.counters[1] = sensor.color->counters();
    sensor.color->set_tap(nullptr);
  }
  out.raw = std::move(keeper.frames);
  return out;
}

}  // namespace tactus::hal::record
