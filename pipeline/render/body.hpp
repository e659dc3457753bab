// Virtual bodies, and the arrays that the GPU draws them from. No GL here.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "hal/calibration.hpp"
#include "pipeline/label/material.hpp"
#include "pipeline/render/camera.hpp"

namespace tactus::render {

/// Two shapes drawn by two programs; half_extent_m.x is the radius of a sphere.
enum class Shape : std::uint8_t { sphere, box };

struct Body {
  Shape shape = Shape::sphere;
  Rgb8 color;
  Vec3f half_extent_m;
  Vec3d center_world_m;
  Quaternion rotation_world_body;  // unit; a sphere looks the same whatever it is
};

/// One sphere: the fragment program cuts each pixel's ray with it, so its outline and depth are exact at any
/// distance.
struct SphereInstance {
  std::array<float, 4> rectangle_ndc{};  // x low, y low, x high, y high: what the sphere can cover
  Vec3f center_depth_m;
  float radius_m = 0;
  std::array<std::uint8_t, 4> color{};  // r g b, 255
};
static_assert(sizeof(SphereInstance) == 36);

/// One box: the unit cube's axes carried into the camera's frame, times the half extents.
struct BoxInstance {
  std::array<Vec3f, 3> half_axes_depth_m{};
  Vec3f center_depth_m;
  std::array<std::uint8_t, 4> color{};
};
static_assert(sizeof(BoxInstance) == 52);

struct InstanceCounts {
  std::size_t spheres_count = 0;
  std::size_t boxes_count = 0;
  std::size_t left_out_count = 0;  // in view, but no room: the last ones in the order of `bodies`
};

/// Turns the bodies that the camera can see into instances, in their order. Bodies outside the view and those
/// with values that are not finite are not drawn. Pure; O(bodies); any phase.
InstanceCounts build_instances(std::span<const Body> bodies, const T_WorldDepth& T_world_depth,
                               const hal::Intrinsics& camera, const ClipRange& range,
                               std::span<SphereInstance> spheres, std::span<BoxInstance> boxes) noexcept;

/// Lowest and highest x / z (or y / z) at which a sphere with its centre at (lateral_m, z_m) in that plane is
/// seen: the slopes of the two tangents from the eye. The whole sphere must lie in front of the eye: z_m >
/// radius_m.
std::array<double, 2> tangent_slopes(double lateral_m, double z_m, double radius_m) noexcept;

}  // namespace tactus::render
