// Where the camera is: coarse-to-fine ICP against the model view, the decision "lost", and what happens then.
//
//   in        half-resolution depth, the model view at the last pose
//   out       T_world_depth with a verdict; the caller integrates only when the verdict is `tracked`
//   budget    budgets.hpp: track        memory  none of its own beyond POD state
//   late      never skipped: pose and display give way last
//   lost      the last good pose is kept; relocalize.hpp proposes poses until one is accepted
#pragma once

#include <cstdint>

#include "pipeline/track/icp.hpp"
#include "rt/status.hpp"

namespace tactus::rt {
class WorkerPool;
}

namespace tactus::track {

/// Thresholds of the verdict.
struct TrackConfig {
  double information_min = 0.004;  // of the mean squared sensitivity, below: a direction is held (icp_solve)
  // Brightness joins in from the second level: texture repeats, so that geometry has to bring it near first. From the
  // first level where geometry's weakest direction has less information than this: rooms have 0.02 and more, fr1/rpy
  // falls to 0.001 and slides without.
  double brightness_first_below = 0.012;
  double inlier_share_min = 0.5;    // inliers / candidates at the finest level
  double overlap_share_min = 0.15;  // candidates / half-resolution pixels
  double residual_m_max = 0.02;     // weighted RMS residual; rooms with noise give 0.003 to 0.008
  double shift_m_max = 0.25;        // between two frames: 7.5 m/s at 30 Hz
  double turn_max = 0.26;           // radians between two frames: 450 degrees/s at 30 Hz
};

struct TrackResult {
  rt::Status status = rt::Status::lost;  // ok or lost
  T_ViewLive T_view_live;
  double inlier_share = 0, overlap_share = 0;
  double residual_m = 0;
  int held_count = 0;  // unobservable directions at the finest level
  int iterations_count = 0;
  std::array<double, 6> information{};
};

/// Runs the levels from `T_guess`. Bounded by the levels' iterations. Step phase.
TrackResult track_frame(const IcpInput& input, std::span<const IcpLevel> levels, const T_ViewLive& T_guess,
                        const TrackConfig& config, rt::WorkerPool& pool) noexcept;

/// A motion carried on for `factor` times as long, or a part of it; as it is for 1. Good to a hundredth up to half a radian:
/// for guesses.
T_ViewLive scaled(const T_ViewLive& motion, double factor) noexcept;

/// Rotation angle of a unit quaternion's rotation in radians, good to 1e-3 up to half a radian: for
/// thresholds.
double small_angle(const Rotation& rotation) noexcept;

}  // namespace tactus::track
