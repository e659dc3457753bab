// What a structured-light depth camera (Kinect v1) does to exact depth.
#pragma once

#include <cstdint>
#include <span>

#include "hal/synthetic/raycast.hpp"

namespace tactus::hal::synthetic {

/// The model, after Nguyen et al. 2012 (axial and lateral noise), Khoshelham & Elberink 2012 (disparity
/// steps) and Handa et al. 2014 (order of application).
namespace noise_model {
inline constexpr double kAxialBase_m = 0.0012,
                        kAxialGrowth_per_m = 0.0019;  // sigma = base + growth (z - 0.4)^2
inline constexpr double kLateral_px = 0.75;           // sigma, at a focal length of 525 px
inline constexpr double kRig_px_m = 580 * 0.075;      // focal length times baseline
inline constexpr double kDisparityStep_px = 1.0 / 8;
inline constexpr double kBaseline_m = 0.075;  // the projector stands this far to the camera's right
inline constexpr double kGrazing_cosine = 0.17364817766693033;  // 80 degrees: beyond, no return
inline constexpr double kZ_m_min = 0.4, kZ_m_max = 8.0;
inline constexpr double kEdgeJump = 0.04;    // relative step of depth between neighbours that is an edge
inline constexpr double kEdgeLoss = 0.5;     // share of pixels lost along edges
inline constexpr double kPaneReturn = 0.12;  // share of 4x4 px patches of glass and mirror that answer at all

[[nodiscard]] constexpr double axial_sigma_m(double z_m) {
  return kAxialBase_m + kAxialGrowth_per_m * (z_m - 0.4) * (z_m - 0.4);
}
}  // namespace noise_model

/// Exact depth to raw units (1/5000 m), rounded; 0 where nothing is hit or the range of 16 bits ends (13.1
/// m).
void quantize_exact(std::span<const float> depth_m, std::span<std::uint16_t> raw);

/// Exact depth to what the sensor would deliver. Holes (0): outside 0.4..8 m, grazing, projector shadow, half
/// of the pixels along depth edges, most of glass and mirror. Else: depth at a laterally jittered place of
/// the same surface, plus axial noise, rounded to disparity steps, rounded to raw units. Every random number
/// is a hash of (seed, frame, pixel): a pure function of its arguments. `hits` with normals. Step: no heap.
void apply_depth_noise(const Scene& scene, const PixelRays& rays, const T_WorldDepth& T_world_depth,
                       const Hits& hits, std::uint64_t seed, int frame_index, std::span<std::uint16_t> raw);

}  // namespace tactus::hal::synthetic
