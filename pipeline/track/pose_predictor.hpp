// Where the camera will be when the picture is seen: the last tracked poses, carried on by a few milliseconds.
//
// Pixels off at 640x480 (525 px), points at 1 to 3 m, p50 / p95, with 0.3 mm and 0.02 degrees (RMS) of tracking noise
// at 30 Hz (tests/pipeline/track/pose_predictor_test). Rooms: hand-held in both rooms, with tremor, of other seeds
// than the model was chosen on. fr1/rpy: real, 1 rad/s to and fro.
//
//                               rooms, 16, 33, 50 ms ahead             fr1/rpy
//   newest pose as it is        4.02/7.17  8.04/14.3  12.1/21.5        11.8/24.1  23.5/47.1  35.0/70.1
//   constant velocity of 2      0.31/0.66  0.55/1.18  0.88/1.90        2.09/6.37  4.44/14.9  7.20/23.4
//   constant velocity of 4      0.54/1.14  0.93/1.97  1.40/2.96        4.01/14.2  6.65/25.7  9.50/37.2
//   acceleration of 3           0.40/0.85  0.78/1.66  1.31/2.79        2.49/7.14  5.74/17.7  9.83/32.5
//   damped acceleration of 4    0.30/0.64  0.52/1.13  0.84/1.80        2.18/6.59  4.33/15.0  6.91/24.3
//
// With that noise on each axis by itself (0.035 degrees in all) the last row is 0.47/1.00, 0.76/1.62, 1.14/2.47.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "hal/transform.hpp"
#include "rt/time.hpp"

namespace tactus::track {

/// The model: shift and rotation vector as a + b t + c t^2 / 2, weighted least squares over the last poses. The penalty
/// on c (a Gaussian prior on acceleration) damps it; time is in thirtieths of a second.
struct PosePredictorConfig {
  std::size_t poses_count = 4;  // 2 .. PosePredictor::kPosesMax
  double decay = 0.5;           // weight of a pose relative to that of the next newer one
  double bend_penalty = 0.2;    // above 1000 it is constant velocity
};

/// Thread-bound; a few hundred bytes, no heap. Any phase, wait-free, below a microsecond.
class PosePredictor {
 public:
  explicit PosePredictor(const PosePredictorConfig& config = {});

  /// A tracked pose. Forgets those before when it comes kGapMax after them or not after them at all, or jumps farther
  /// than tracking follows (relocalisation). A pose that is not finite leaves nothing.
  void push(rt::SensorTime time, const T_WorldDepth& T_world_depth) noexcept;
  /// To be called when tracking is lost.
  void reset() noexcept { count_ = 0; }
  /// The pose at `time`, at most kAheadMax after the newest; a single pose stands still. Nothing without a pose.
  [[nodiscard]] std::optional<T_WorldDepth> predict(rt::SensorTime time) const noexcept;
  [[nodiscard]] std::size_t poses_count() const noexcept { return count_; }

  static constexpr std::size_t kPosesMax = 8;
  static constexpr rt::Duration kGapMax{150'000'000};
  static constexpr rt::Duration kAheadMax{100'000'000};
  static constexpr double kShiftMaxM = 0.25, kTurnMax = 0.26;  // between two poses, as TrackConfig; radians

 private:
  struct Stamped {
    rt::SensorTime time;
    T_WorldDepth T_world_depth;
  };
  PosePredictorConfig config_;
  std::array<Stamped, kPosesMax> poses_{};  // newest first
  std::size_t count_ = 0;
};

}  // namespace tactus::track
