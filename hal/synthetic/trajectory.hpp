// The path of a camera in a hand: a closed loop with tremor.
#pragma once

#include "hal/synthetic/options.hpp"
#include "hal/transform.hpp"

namespace tactus::hal::synthetic {

/// Exact pose of the depth camera at a frame; a pure function of its arguments.
///
/// handheld: one turn of a Lissajous loop about the scene's LoopSpec, eased in and out over 8 % of the time,
/// with three tremor tones between 2 and 5 Hz per axis (together 2.4 mm and 0.24 degrees at most) that fade
/// in and out over half a second. The last frame has the first frame's pose. Sessions shorter than 300 frames
/// make a proportionally smaller loop, so that speeds stay the same: at most 0.5 m/s and 40 degrees/s. still:
/// the first frame's pose. Frames from blank_first + blank_count on are displaced when options.has_jump: 13
/// cm sideways and 6.5 degrees of yaw.
T_WorldDepth pose_at(const SyntheticOptions& options, const LoopSpec& loop, int frame_index);

}  // namespace tactus::hal::synthetic
