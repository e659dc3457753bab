// Where the light's map of shadows lies: the smallest upright box along the light that holds the casters. No
// GL here.
#pragma once

#include <array>
#include <span>

#include "hal/transform.hpp"
#include "pipeline/render/body.hpp"

namespace tactus::render {

inline constexpr int kShadowMapPixels = 512;

/// How far behind its caster a shadow is drawn: from a ball at 1.5 m to the floor under a lamp 45 degrees
/// high it is 2.1 m.
inline constexpr float kShadowSweepM = 3;

struct ShadowView {
  std::array<float, 16> shadow_from_depth{};  // column-major; u, v, depth from the light in [0, 1]
  Vec3f axis_x_depth;                         // unit; the map's u
  float texel_m = 0;
};

/// Orthographic view along the light. Its side is a multiple of 1/8 m and its corner one of a texel in the
/// world, so that edges of shadows do not swim when bodies or the head move. No casters: everything is lit.
/// Pure; O(casters); any phase. toward_world: not zero.
ShadowView fit_shadow(std::span<const Caster> casters, const T_WorldDepth& T_world_depth,
                      const Vec3f& toward_world) noexcept;

/// Finds for each caster which stretch of its sweep, up to kShadowSweepM, holds real surfaces, from every
/// 80th part of the picture's width; those whose shadow meets none go. Answers how many are left, at the
/// front and in their order. Without it a prism of 3 m hides half the picture, and each of its pixels costs
/// as much as five of the video. `depth_m` is seen by a camera turned by R_video_picture against the
/// picture's. Pure; O(4800 x casters); any phase.
std::size_t find_sweeps(std::span<const float> depth_m, const hal::Intrinsics& camera,
                        const Rotation& R_video_picture, const Vec3f& toward_light_depth,
                        const Vec3f& axis_x_depth, std::span<Caster> casters) noexcept;

}  // namespace tactus::render
