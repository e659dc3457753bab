// The cameras as the pipeline sees them. A backend implements these in its own folder; the pipeline knows no backend.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hal/calibration.hpp"
#include "hal/raw_frame.hpp"
#include "rt/status.hpp"
#include "rt/time.hpp"

namespace tactus::hal {

/// Counted by the camera since start; what a session could go on without, it skips and counts here.
struct CameraCounters {
  std::uint64_t frames_delivered = 0;
  std::uint64_t frames_rejected = 0;         // corrupt, wrong size, unreadable
  std::uint64_t timestamps_rejected = 0;     // not later than the frame before
  std::uint64_t frames_missing = 0;          // numbers that a live device left out: it, or its driver, lost them
  std::uint64_t losses = 0;                  // times that the device went away
  std::string first_rejection;               // one sentence naming the file and what is wrong; empty when none
};

/// What both kinds of camera do. Thread-bound: one thread reads.
class Camera {
 public:
  virtual ~Camera() = default;
  [[nodiscard]] virtual const CameraCounters& counters() const = 0;
  /// From now on every frame taken from the device is shown to `tap` as it came, before it is converted; null: to none.
  /// `tap` outlives the camera or is taken back. Cameras around another hand it on. Boot.
  virtual void set_tap(FrameTap* tap) { tap_ = tap; }

 protected:
  FrameTap* tap_ = nullptr;
};

/// A stream of depth images: row-major uint16 raw values, 0 = no measurement. Backends map their other invalid codes
/// (65535 in 7-Scenes) to 0, so that the pipeline knows one.
class DepthCamera : public Camera {
 public:
  /// Writes the next frame into `depth` (width * height values) and `header`. May wait up to `timeout`.
  /// ok | timeout | corrupt (this frame was rejected and counted; the next may be good) | device_lost (it is away; a
  /// later read() looks for it again, and goes on with the same calibration when it is back) | end_of_stream.
  virtual rt::Status read(std::span<std::uint16_t> depth, FrameHeader& header, rt::Duration timeout) = 0;
};

/// A stream of colour images: row-major interleaved 8-bit R, G, B.
class ColorCamera : public Camera {
 public:
  /// As DepthCamera::read, with width * height * 3 bytes.
  virtual rt::Status read(std::span<std::uint8_t> rgb, FrameHeader& header, rt::Duration timeout) = 0;
  /// Says which frame is next and leaves it in the device's buffer: read() then has it (or finds it corrupt), skip() passes
  /// over it. Answers as read(); corrupt: the next frame was rejected, and is passed over already.
  virtual rt::Status peek(FrameHeader& header, rt::Duration timeout) = 0;
  /// Passes over the frame that peek() has announced, without converting or copying it; it counts as delivered.
  virtual void skip() = 0;
};

/// A pose known from outside (motion capture, a simulator), for evaluation only; the pipeline never sees it.
struct TruthPose {
  rt::SensorTime time;
  T_WorldDepth T_world_depth;
};

/// An opened sensor: the cameras and what is known of them. Built at boot by a backend's open function.
struct Sensor {
  std::string description;              // one line for people: what this is and where it came from
  bool is_live = false;                 // a device: it has no end, drops what nobody takes, and may go away
  bool has_two_clocks = false;          // colour's times are another clock's: FrameHeader::arrived brings them together
  bool allocates_in_read = false;       // read() decodes on the caller's thread
  std::size_t buffers_bytes = 0;        // what the backend holds for its frames, outside of the plan's arena
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
