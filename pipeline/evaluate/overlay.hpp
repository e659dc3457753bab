// How far beside their true place virtual things are drawn, in pixels, when their camera's pose was predicted.
#pragma once

#include <span>

#include "hal/calibration.hpp"
#include "pipeline/evaluate/trajectory.hpp"

namespace tactus::evaluate {

/// Percentiles over poses; each pose counts by the mean over a grid of 3 x 3 points in its picture.
struct OverlayError {
  std::size_t poses_count = 0;
  double p50_px = 0, p95_px = 0, max_px = 0;
};

/// `drawn` against `true_poses` at the same times (to 1 ms), in one world: `T_true_drawn` carries points of the first into
/// the second. Points lie at `depth_m` in front of the camera. All zero when no pose has a partner.
OverlayError overlay_error(std::span<const StampedPose> drawn, std::span<const StampedPose> true_poses,
                           const Alignment& T_true_drawn, const hal::Intrinsics& camera, double depth_m);

}  // namespace tactus::evaluate
