// One opened live camera, before a rig is made of one or two: what the backends of V4L2 and libcamera answer.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "hal/camera.hpp"

namespace tactus::hal {

/// What is asked of a device; 0: its own choice.
struct ModeRequest {
  int width = 0, height = 0;  // pixels
  double frame_rate_hz = 0;
};

/// CameraKind is DepthCamera or ColorCamera.
template <typename CameraKind>
struct LiveCamera {
  std::unique_ptr<CameraKind> camera;
  int width = 0, height = 0;   // pixels, as negotiated
  double frame_rate_hz = 30;   // nominal
  bool has_host_clock = false; // FrameHeader::time is on the monotonic clock, so that two such cameras share one
  std::size_t buffers_bytes = 0;
  std::string description;     // one line: device, driver, format, mode, kind of buffers
  std::vector<std::string> notes;
};

}  // namespace tactus::hal
