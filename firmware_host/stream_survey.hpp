// What reading a source to its end shows of its two streams: rates, gaps, how colour lies beside depth, how clocks run.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "firmware_host/frame_range.hpp"
#include "hal/camera.hpp"
#include "pipeline/capture/pairing.hpp"

namespace tactus::firmware {

struct StreamInfo {
  hal::CameraCounters counters;
  rt::SensorTime first, last;
  std::uint64_t frames_count = 0;
  std::uint64_t gaps_count = 0;  // pauses of more than one and a half nominal intervals
  rt::Duration gap_max;
  std::uint64_t gap_max_before = 0;  // sequence number of the frame after the longest pause
  std::uint64_t missing_count = 0;   // sequence numbers that were never seen
  rt::Status ended_by = rt::Status::ok;
  std::optional<double> drift_ppm;   // of the device's clock against the host's, where arrivals are known for 3 s

  [[nodiscard]] double rate_hz() const {
    const double s = (last - first).seconds();
    return frames_count > 1 && s > 0 ? static_cast<double>(frames_count - 1) / s : 0;
  }
};

struct DepthContent {
  double valid_share = 0;
  double nearest_m = 0, median_m = 0, farthest_m = 0;  // 1st, 50th and 99th percentile of what was measured
};

struct Survey {
  StreamInfo depth;
  std::optional<StreamInfo> color;
  DepthContent content;
  Pairing pairing;              // as `tactus run` pairs them; empty without colour
  std::uint64_t pixel_bytes = 0;  // of all frames as pixels: 2 bytes of depth, 3 of colour
};

/// Reads both cameras to their end; of a device without one, 5 s. Boot.
Survey survey(hal::Sensor& sensor, const std::string& source, FrameRange frames);

}  // namespace tactus::firmware
