// All frames of a source, for comparing what went through a recording with what went in.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

#include "firmware_host/open_source.hpp"

namespace tactus::test {

template <typename Pixel>
struct SeenFrame {
  hal::FrameHeader header;
  std::vector<Pixel> pixels;
};

struct SeenFrames {
  std::vector<SeenFrame<std::uint16_t>> depth;
  std::vector<SeenFrame<std::uint8_t>> color;
  hal::Sensor sensor;  // at its end
};

template <typename Pixel, typename Camera>
std::vector<SeenFrame<Pixel>> all_of(Camera& camera, std::size_t values_count) {
  std::vector<SeenFrame<Pixel>> frames;
  for (;;) {
    SeenFrame<Pixel> frame{{}, std::vector<Pixel>(values_count)};
    const rt::Status status = camera.read(frame.pixels, frame.header, rt::Duration{1'000'000'000});
    if (status == rt::Status::corrupt) continue;
    if (status != rt::Status::ok) return frames;
    frames.push_back(std::move(frame));
  }
}

inline SeenFrames frames_of(const std::string& source, const firmware::SourceOptions& options = {}) {
  SeenFrames seen;
  auto sensor = firmware::open_source(source, options);
  if (!sensor) {
    ADD_FAILURE() << sensor.error().message;
    return seen;
  }
  seen.sensor = std::move(*sensor);
  const hal::RigCalibration& rig = seen.sensor.calibration;
  const auto pixels = [](const hal::Intrinsics& k) {
    return static_cast<std::size_t>(k.width) * static_cast<std::size_t>(k.height);
  };
  seen.depth = all_of<std::uint16_t>(*seen.sensor.depth, pixels(rig.depth));
  if (seen.sensor.color) seen.color = all_of<std::uint8_t>(*seen.sensor.color, pixels(rig.color) * 3);
  return seen;
}

template <typename Pixel>
void expect_same_frames(const std::vector<SeenFrame<Pixel>>& a, const std::vector<SeenFrame<Pixel>>& b,
                        std::int64_t time_slack_ns = 0) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_LE(std::abs(a[i].header.time.ns - b[i].header.time.ns), time_slack_ns) << "frame " << i;
    EXPECT_TRUE(a[i].pixels == b[i].pixels) << "frame " << i;
  }
}

}  // namespace tactus::test
