// Virtual bodies, and the arrays that the GPU draws them from. No GL here.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "hal/calibration.hpp"
#include "pipeline/label/material.hpp"
#include "pipeline/render/camera.hpp"
#include "pipeline/render/mesh.hpp"

namespace tactus::render {

/// Capsule and cylinder stand along the body's z.
enum class Shape : std::uint8_t { sphere, box, capsule, cylinder, hull };

struct Body {
  Shape shape = Shape::sphere;
  Rgb8 color;
  Vec3f half_extent_m;  // box; x alone is the radius of sphere, capsule and cylinder; hull: not read
  Vec3d center_world_m;
  Quaternion rotation_world_body;  // unit; a sphere looks the same whatever it is
  float half_length_m = 0;         // cylinder; capsule: of its axis, without the caps
  std::uint16_t hull_index = 0;  // into RenderConfig::hulls; a hull that is not there is not drawn
  float roughness = 0.5F;  // perceptual: 0 a mirror, 1 chalk
  float metalness = 0;     // 0 plastic, stone, wood; 1 bare metal
};

/// One sphere: the fragment program cuts each pixel's ray with it, so its outline and depth are exact at any
/// distance.
struct SphereInstance {
  std::array<float, 4> rectangle_ndc{};  // x low, y low, x high, y high: what the sphere can cover
  Vec3f center_depth_m;
  float radius_m = 0;
  std::array<std::uint8_t, 4> color{};   // r g b, 255
  std::array<std::uint8_t, 4> finish{};  // roughness, metalness, 0, 0
};
static_assert(sizeof(SphereInstance) == 40);

/// One mesh: its axes carried into the camera's frame, times the half extents.
struct MeshInstance {
  std::array<Vec3f, 3> half_axes_depth_m{};
  Vec3f center_depth_m;
  float half_length_m = 0;  // of a capsule
  std::array<std::uint8_t, 4> color{};
  std::array<std::uint8_t, 4> finish{};
};
static_assert(sizeof(MeshInstance) == 60);

/// The ball that holds a body which can throw a shadow into the picture, and where behind it (metres from the
/// centre, away from the light) real surfaces are that its shadow can fall on.
struct Caster {
  Vec3f center_depth_m;
  float radius_m = 0;
  float sweep_begin_m = 0;
  float sweep_end_m = 0;
  Vec3f place_light_m;  // the centre in the light's axes
};
static_assert(sizeof(Caster) == 36);

struct InstanceCounts {
  /// A run of instances: the first ones are in view, all of them throw shadows.
  struct Run {
    std::size_t first = 0, in_view_count = 0, count = 0;
  };
  Run spheres;
  std::array<Run, kMeshesMax> meshes{};  // by the mesh's number
  std::size_t in_view_count = 0;
  std::size_t casters_count = 0;
  std::size_t left_out_count = 0;  // in view, but no room: the last ones in the order of `bodies`
};

/// A body farther than this from the eye throws no shadow, so that one which fell out of the room does not
/// take the shadow map's texels from the others.
inline constexpr double kCasterReachM = 5;

/// Turns bodies into instances, those in view first, else in their order. Bodies that neither can be seen nor
/// throw a shadow (kCasterReachM) and those with values that are not finite are left away. `meshes` is room
/// for all meshes together, `casters` for all instances. Pure; O(bodies); any phase.
InstanceCounts build_instances(std::span<const Body> bodies, const T_WorldDepth& T_world_depth,
                               const hal::Intrinsics& camera, const ClipRange& range,
                               std::span<const float> hull_radii_m, std::span<SphereInstance> spheres,
                               std::span<MeshInstance> meshes, std::span<Caster> casters) noexcept;

/// The rectangle (x low, y low, x high, y high in NDC) of the pixels that can see a ball; false when none
/// can. Pure.
bool cover_ball(const Vec3d& center_depth_m, double radius_m, const hal::Intrinsics& camera,
                const ClipRange& range, std::array<float, 4>& rectangle_ndc) noexcept;

/// Lowest and highest x / z (or y / z) at which a sphere with its centre at (lateral_m, z_m) in that plane is
/// seen: the slopes of the two tangents from the eye. The whole sphere must lie in front of the eye: z_m >
/// radius_m.
std::array<double, 2> tangent_slopes(double lateral_m, double z_m, double radius_m) noexcept;

}  // namespace tactus::render
