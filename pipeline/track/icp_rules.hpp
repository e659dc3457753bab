// Constants and the layout of partial sums that the vector kernel and the reference share.
#pragma once

#include <algorithm>
#include <cstddef>

#include "pipeline/track/icp.hpp"

namespace tactus::track {

inline constexpr std::size_t kVirtualLanes = 16;
inline constexpr std::size_t kRowB = 21, kRowResidual2 = 27, kRowWeight = 28, kRowInliers = 29,
                             kRowCandidates = 30, kRowModel = 31, kRowsCount = 32;

struct IcpConstants {
  static constexpr float kNearM = 0.1f;
  static constexpr float kSigmaBaseM = 0.0012f, kSigmaSlope = 0.0019f;  // depth_sigma_m()
  // Weights are Huber's only. Inverse variance looks better on paper and was worse: it hands the pose to the
  // few near surfaces, whose systematic errors (the grid's rounding, disparity steps) are larger than their
  // noise (ATE over 150 frames of the noisy bedroom: 0.36 mm rigid against 0.68).
  static constexpr float kHuberSigmas = 2.0f;
  // A brightness step of one grey level counts like this much distance. Rigid ATE at 1.5, 3, 6 mm, keyframes of one
  // frame's age and more: noisy bedroom 0.39, 0.39, 0.38 mm, noisy office 0.77, 0.63, 0.77 mm, 7-Scenes kitchen 16, 14,
  // 13 mm, TUM fr1/rpy 50, 32, 52 mm.
  static constexpr float kMetresPerGrey = 0.003f;
  // From a BrightnessWord's difference, quarters of a level over two pixels, to minus metres per pixel.
  static constexpr float kGradientScale = -0.125f * kMetresPerGrey;
  static constexpr float kGreyHuber = 20.0f;
  static constexpr float kGreyGate = 80.0f;

  IcpConstants(const IcpInput& input, const T_ViewLive& T_view_live, const IcpLevel& level) {
    const auto T_live_view = T_view_live.inverse();
    const auto fill = [](float* to, const Rotation& r, const Vec3d& t) {
      const double translation[3] = {t.x, t.y, t.z};
      for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j) to[i * 4 + j] = static_cast<float>(r.m[i * 3 + j]);
        to[i * 4 + 3] = static_cast<float>(translation[i]);
      }
    };
    fill(to_live, T_live_view.rotation, T_live_view.translation);
    fill(to_view, T_view_live.rotation, T_view_live.translation);
    const auto& camera = input.model->camera;
    fx = static_cast<float>(camera.fx);
    fy = static_cast<float>(camera.fy);
    cx = static_cast<float>(camera.cx);
    cy = static_cast<float>(camera.cy);
    inverse_fx = 1.0f / fx;
    inverse_fy = 1.0f / fy;
    pivot_z = input.pivot_z_m;
    distance2_max = level.distance_m_max * level.distance_m_max;
  }

  float to_live[12], to_view[12];  // rows of (R | t)
  float fx, fy, cx, cy, inverse_fx, inverse_fy;
  float pivot_z;
  float distance2_max;
};

}  // namespace tactus::track
