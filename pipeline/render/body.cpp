#include "pipeline/render/body.hpp"

#include <algorithm>
#include <cmath>

#include "rt/assert.hpp"

namespace tactus::render {
namespace {

constexpr float kMarginPixels = 0.5F;  // rounding must not cut the outermost pixel off

bool is_finite(const Body& body) {
  const Quaternion& q = body.rotation_world_body;
  return std::isfinite(body.center_world_m.x + body.center_world_m.y + body.center_world_m.z) &&
         std::isfinite(body.half_extent_m.x + body.half_extent_m.y + body.half_extent_m.z +
                       body.half_length_m + body.roughness + body.metalness) &&
         std::isfinite(q.w + q.x + q.y + q.z);
}

std::array<std::uint8_t, 4> bytes(Rgb8 color) { return {color.r, color.g, color.b, 255}; }

std::uint8_t byte_of_part(float part) {
  return static_cast<std::uint8_t>(std::clamp(part, 0.0F, 1.0F) * 255 + 0.5F);
}

std::array<std::uint8_t, 4> finish_of(const Body& body) {
  return {byte_of_part(body.roughness), byte_of_part(body.metalness), 0, 0};
}

/// Of the sphere around the centre that holds the body; 0: nothing to draw.
float radius_of(const Body& body, std::span<const float> hull_radii_m) {
  const Vec3f& half = body.half_extent_m;
  switch (body.shape) {
    case Shape::sphere:
      return half.x;
    case Shape::box:
      return half.norm();
    case Shape::capsule:
      return half.x > 0 ? half.x + std::max(body.half_length_m, 0.0F) : 0;
    case Shape::cylinder:
      return half.x > 0 && body.half_length_m > 0 ? Vec3f{half.x, body.half_length_m, 0}.norm() : 0;
    case Shape::hull:
      return body.hull_index < hull_radii_m.size() ? hull_radii_m[body.hull_index] : 0;
  }
  return 0;
}

std::size_t mesh_of(const Body& body) {
  switch (body.shape) {
    case Shape::cylinder:
      return kCylinderMesh;
    case Shape::capsule:
      return kCapsuleMesh;
    case Shape::hull:
      return kFirstHullMesh + body.hull_index;
    default:
      return kBoxMesh;
  }
}

Vec3f half_axes_lengths(const Body& body) {
  const float radius_m = body.half_extent_m.x;
  switch (body.shape) {
    case Shape::cylinder:
      return {radius_m, radius_m, body.half_length_m};
    case Shape::capsule:
      return {radius_m, radius_m, radius_m};
    case Shape::hull:
      return {1, 1, 1};
    default:
      return body.half_extent_m;
  }
}

struct Placed {
  bool is_drawn = false;  // in view, or throws a shadow
  bool is_in_view = false;
  Vec3d center_m;
  float radius_m = 0;
  std::array<float, 4> rectangle_ndc{};
};

}  // namespace

bool cover_ball(const Vec3d& center_m, double radius_m, const hal::Intrinsics& camera, const ClipRange& range,
                std::array<float, 4>& rectangle_ndc) noexcept {
  if (center_m.z + radius_m <= static_cast<double>(range.near_m) ||
      center_m.z - radius_m >= static_cast<double>(range.far_m))
    return false;
  rectangle_ndc = {-1, -1, 1, 1};
  if (center_m.z <= radius_m + static_cast<double>(range.near_m))
    return true;  // around the eye's plane: no tangents

  const auto x = tangent_slopes(center_m.x, center_m.z, radius_m);
  const auto y = tangent_slopes(center_m.y, center_m.z, radius_m);
  const double width = camera.width, height = camera.height;
  const float margin_x = 2 * kMarginPixels / static_cast<float>(width);
  const float margin_y = 2 * kMarginPixels / static_cast<float>(height);
  rectangle_ndc = {static_cast<float>(2 * (camera.fx * x[0] + camera.cx + 0.5) / width - 1) - margin_x,
                   static_cast<float>(1 - 2 * (camera.fy * y[1] + camera.cy + 0.5) / height) - margin_y,
                   static_cast<float>(2 * (camera.fx * x[1] + camera.cx + 0.5) / width - 1) + margin_x,
                   static_cast<float>(1 - 2 * (camera.fy * y[0] + camera.cy + 0.5) / height) + margin_y};
  return rectangle_ndc[0] < 1 && rectangle_ndc[1] < 1 && rectangle_ndc[2] > -1 && rectangle_ndc[3] > -1;
}

// The tangent slopes m solve (lateral - m z)^2 = r^2 (1 + m^2).
std::array<double, 2> tangent_slopes(double lateral_m, double z_m, double radius_m) noexcept {
  const double a = z_m * z_m - radius_m * radius_m;
  TACTUS_ASSERT(z_m > 0 && a > 0);
  const double half_width = radius_m * std::sqrt(lateral_m * lateral_m + a);
  return {(lateral_m * z_m - half_width) / a, (lateral_m * z_m + half_width) / a};
}

namespace {

Placed place(const Body& body, const Transform<Depth, World>& T_depth_world, const hal::Intrinsics& camera,
             const ClipRange& range, std::span<const float> hull_radii_m) {
  Placed placed;
  if (!is_finite(body)) return placed;
  placed.radius_m = radius_of(body, hull_radii_m);
  if (!(placed.radius_m > 0)) return placed;
  placed.center_m = T_depth_world * body.center_world_m;
  // A mesh is looked for inside the sphere around it; GL clips what of it is out of view.
  placed.is_in_view =
      cover_ball(placed.center_m, static_cast<double>(placed.radius_m), camera, range, placed.rectangle_ndc);
  placed.is_drawn = placed.is_in_view || placed.center_m.norm() < kCasterReachM;
  return placed;
}

MeshInstance mesh_instance(const Body& body, const Placed& placed, const Rotation& R_depth_world) {
  const Rotation rotation = R_depth_world * Rotation::from(body.rotation_world_body);
  const Vec3f half_m = half_axes_lengths(body);
  const auto axis = [&rotation](int column, float length_m) {
    return Vec3d{rotation(0, column), rotation(1, column), rotation(2, column)}.cast<float>() * length_m;
  };
  return {{axis(0, half_m.x), axis(1, half_m.y), axis(2, half_m.z)},
          placed.center_m.cast<float>(),
          body.shape == Shape::capsule ? std::max(body.half_length_m, 0.0F) : 0.0F,
          bytes(body.color),
          finish_of(body)};
}

}  // namespace

InstanceCounts build_instances(std::span<const Body> bodies, const T_WorldDepth& T_world_depth,
                               const hal::Intrinsics& camera, const ClipRange& range,
                               std::span<const float> hull_radii_m, std::span<SphereInstance> spheres,
                               std::span<MeshInstance> meshes, std::span<Caster> casters) noexcept {
  InstanceCounts counts;
  const Transform<Depth, World> T_depth_world = T_world_depth.inverse();
  const auto for_each = [&](bool is_in_view, auto&& take) {
    for (const Body& body : bodies) {
      const Placed placed = place(body, T_depth_world, camera, range, hull_radii_m);
      if (placed.is_drawn && placed.is_in_view == is_in_view) take(body, placed);
    }
  };

  // First how many of each mesh, so that each has one run of instances; then the instances, in the same
  // order.
  std::size_t meshes_count = 0;
  for (const bool is_in_view : {true, false})
    for_each(is_in_view, [&](const Body& body, const Placed&) {
      const bool is_sphere = body.shape == Shape::sphere;
      if (is_sphere ? counts.spheres.count == spheres.size() : meshes_count == meshes.size()) {
        if (is_in_view) ++counts.left_out_count;
        return;
      }
      InstanceCounts::Run& run = is_sphere ? counts.spheres : counts.meshes[mesh_of(body)];
      ++run.count;
      if (!is_sphere) ++meshes_count;
      if (!is_in_view) return;
      ++run.in_view_count;
      ++counts.in_view_count;
    });
  for (std::size_t i = 1; i < kMeshesMax; ++i)
    counts.meshes[i].first = counts.meshes[i - 1].first + counts.meshes[i - 1].count;

  std::size_t spheres_next = 0, taken_count = 0;
  std::array<std::size_t, kMeshesMax> next{};
  for (const bool is_in_view : {true, false})
    for_each(is_in_view, [&](const Body& body, const Placed& placed) {
      if (body.shape == Shape::sphere) {
        if (spheres_next == spheres.size()) return;
        spheres[spheres_next++] = {placed.rectangle_ndc, placed.center_m.cast<float>(), placed.radius_m,
                                   bytes(body.color), finish_of(body)};
      } else {
        if (taken_count == meshes.size()) return;
        ++taken_count;
        const std::size_t mesh = mesh_of(body);
        meshes[counts.meshes[mesh].first + next[mesh]++] =
            mesh_instance(body, placed, T_depth_world.rotation);
      }
      if (placed.center_m.norm() < kCasterReachM && counts.casters_count < casters.size())
        casters[counts.casters_count++] = {placed.center_m.cast<float>(), placed.radius_m, 0, 0, {}};
    });
  return counts;
}

}  // namespace tactus::render
