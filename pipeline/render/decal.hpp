// Marks that touches leave on real surfaces, and the array that the GPU draws them from. No GL here.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "hal/calibration.hpp"
#include "pipeline/label/decal_kind.hpp"
#include "pipeline/label/material.hpp"
#include "pipeline/render/camera.hpp"

namespace tactus::render {

inline constexpr std::size_t kDecalsMax = 128;

/// A disc that clings to the real surface: drawn where a pixel's real point is within radius_m of the disc's
/// axis and within kDecalThicknessM of its plane.
struct Decal {
  DecalKind kind = DecalKind::none;  // none is not drawn
  Vec3d position_world_m;
  Vec3f normal_world;  // need not be unit; a zero one is not drawn
  float radius_m = 0;
  Rgb8 tint;               // what comes to light below the surface: dust, raw wood, fibres, metal
  std::uint32_t seed = 0;  // two decals of one kind and seed look the same
};
inline constexpr double kDecalThicknessM = 0.02;

struct DecalInstance {
  std::array<float, 4> rectangle_ndc{};
  Vec3f center_depth_m;
  float radius_m = 0;
  Vec3f axis_x_depth;  // unit, in the disc; turned about the normal by the seed
  Vec3f axis_y_depth;
  std::array<std::uint8_t, 4> tint{};
  std::uint32_t seed = 0;
};
static_assert(sizeof(DecalInstance) == 64);

/// Runs of instances by kind.
struct DecalCounts {
  std::array<std::size_t, kDecalKindsCount> first{}, count{};
  std::size_t total_count = 0;
};

/// Turns the decals that the camera can see into instances, by kind, else in their order; the first
/// kDecalsMax of them are looked at. Values that are not finite are not drawn. Pure; O(decals); any phase.
DecalCounts build_decals(std::span<const Decal> decals, const T_WorldDepth& T_world_depth,
                         const hal::Intrinsics& camera, const ClipRange& range,
                         std::span<DecalInstance> instances) noexcept;

}  // namespace tactus::render
