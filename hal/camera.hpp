// The cameras as the pipeline sees them. A backend implements these in its own folder; the pipeline knows no backend.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hal/calibration.hpp"
#include "rt/status.hpp"
#include "rt/time.hpp"

namespace tactus::hal {

/// What comes with every image.
struct FrameHeader {
  rt::SensorTime time;          // exposure midpoint on the device's clock
  std::uint64_t sequence = 0;   // counts up by one per frame the device took; a gap is a lost frame
};

/// Counted by the camera since start; what a session could go on without, it skips and counts here.
struct CameraCounters {
  std::uint64_t frames_delivered = 0;
  std::uint64_t frames_rejected = 0;         // corrupt, wrong size, unreadable
  std::uint64_t timestamps_rejected = 0;     // not later than the frame before
  std::string first_rejection;               // one sentence naming the file and what is wrong; empty when none
};

/// A stream of depth images: row-major uint16 raw values, 0 = no measurement. Backends map their other invalid codes
/// (65535 in 7-Scenes) to 0, so that the pipeline knows one. Thread-bound: one thread calls read().
class DepthCamera {
 public:
  virtual ~DepthCamera() = default;
  /// Writes the next frame into `depth` (width * height values) and `header`. May wait up to `timeout`.
  /// ok | timeout | corrupt (this frame was rejected and counted; the next may be good) | device_lost | end_of_stream.
  virtual rt::Status read(std::span<std::uint16_t> depth, FrameHeader& header, rt::Duration timeout) = 0;
  [[nodiscard]] virtual const CameraCounters& counters() const = 0;
};

/// A stream of colour images: row-major interleaved 8-bit R, G, B.
class ColorCamera {
 public:
  virtual ~ColorCamera() = default;
  /// As DepthCamera::read, with width * height * 3 bytes.
  virtual rt::Status read(std::span<std::uint8_t> rgb, FrameHeader& header, rt::Duration timeout) = 0;
  [[nodiscard]] virtual const CameraCounters& counters() const = 0;
};

/// A pose known from outside (motion capture, a simulator), for evaluation only; the pipeline never sees it.
struct TruthPose {
  rt::SensorTime time;
  T_WorldDepth T_world_depth;
};

/// An opened sensor: the cameras and what is known of them. Built at boot by a backend's open function.
struct Sensor {
  std::string description;              // one line for people: what this is and where it came from
  RigCalibration calibration;
  double frame_rate_hz = 30;            // nominal
  std::uint64_t frames_count = 0;       // 0 when unknown (a live device)
  std::unique_ptr<DepthCamera> depth;
  std::unique_ptr<ColorCamera> color;   // null: depth-only
  std::optional<Vec3d> gravity_depth;   // direction of gravity in the first depth frame (unit), when known
  std::vector<TruthPose> truth;         // empty when unknown
  /// Exact material ids for the depth frame with this sequence number, when the source knows them (synthetic rooms,
  /// recordings with label/): fills width * height ids, 255 = unknown. Null when it does not.
  std::unique_ptr<class LabelTruth> labels;
  std::vector<std::string> notes;       // one sentence each: what a person should know (skipped poses, assumed values)
};

class LabelTruth {
 public:
  virtual ~LabelTruth() = default;
  virtual rt::Status read(std::uint64_t sequence, std::span<std::uint8_t> material_ids) = 0;
};

}  // namespace tactus::hal
