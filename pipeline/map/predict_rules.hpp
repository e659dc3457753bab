// Numbers and per-view constants that the vector kernel and the reference share.
#pragma once

#include "pipeline/map/predict.hpp"

namespace tactus::map {

/// Half the window of the normals' fit: 23 mm at 2 m in a 320-pixel view, the reach of a centimetre voxel's
/// rounding.
inline constexpr int kFitPixels = 3;
inline constexpr float kFitRowWeight = 28.0f;  // sum of k^2, k = -3 .. 3
/// Second difference over the window that is tolerated: this many sigmas of a single measurement, and a
/// millimetre.
inline constexpr float kBendSigmas = 1.5f, kBendBaseM = 0.001f;

struct PredictConstants {
  static constexpr float kValueMax = 0.95f;     // beyond, the first read is saturated and says nothing
  static constexpr float kResidualMax = 0.25f;  // truncations left after the first step: 1 cm of 4
  static constexpr float kSlopeMin = 0.02f;   // least change of the field between the reads for a secant step
  static constexpr float kFacingMin = 0.05f;  // least cosine between normal and ray

  PredictConstants(const Map& map, const ModelView& view) {
    const float to_voxels = 1.0f / map.config().voxel_size_m;
    for (std::size_t i = 0; i < 9; ++i) r[i] = static_cast<float>(view.T_world_view.rotation.m[i]);
    ox = static_cast<float>(view.T_world_view.translation.x) * to_voxels;
    oy = static_cast<float>(view.T_world_view.translation.y) * to_voxels;
    oz = static_cast<float>(view.T_world_view.translation.z) * to_voxels;
    scale = to_voxels;
    truncation_m = map.config().truncation_m;
    cx = static_cast<float>(view.camera.cx);
    cy = static_cast<float>(view.camera.cy);
    inverse_fx = 1.0f / static_cast<float>(view.camera.fx);
    inverse_fy = 1.0f / static_cast<float>(view.camera.fy);
  }

  float r[9];
  float ox, oy, oz;  // camera centre, voxels
  float scale;       // voxels per metre
  float truncation_m;
  float cx, cy, inverse_fx, inverse_fy;
};

struct PredictNormalConstants {
  explicit PredictNormalConstants(const ModelView& view)
      : fx(static_cast<float>(view.camera.fx)),
        fy(static_cast<float>(view.camera.fy)),
        cx(static_cast<float>(view.camera.cx)),
        cy(static_cast<float>(view.camera.cy)) {}
  float fx, fy, cx, cy;
  float per_pixel = 1.0f / (kFitRowWeight * static_cast<float>(2 * kFitPixels + 1));
};

}  // namespace tactus::map
