// The virtual camera that sees exactly what the real one sees.
#pragma once

#include <array>

#include "hal/calibration.hpp"

namespace tactus::render {

/// Nothing virtual is drawn nearer or farther than this (z in the optical frame, metres).
struct ClipRange {
  float near_m = 0.05F;
  float far_m = 20.0F;
};

/// Column-major 4x4 matrix from the optical frame (x right, y down, z forward, metres) to GL clip space.
using Projection = std::array<float, 16>;

/// The pinhole as a GL projection. Our pixel centres are at integers and row 0 is the top one; GL's are at
/// halves and its row 0 is the bottom one. With w = z that gives
///   x_ndc =  2 (fx x/z + cx + 1/2) / width - 1,   y_ndc = 1 - 2 (fy y/z + cy + 1/2) / height,
/// so a point falls on its pixel with no error but rounding. Distortion is not modelled: `camera` must have
/// none.
Projection projection_matrix(const hal::Intrinsics& camera, const ClipRange& range);

}  // namespace tactus::render
