#include "pipeline/render/body.hpp"

#include <cmath>

#include "rt/assert.hpp"

namespace tactus::render {
namespace {

constexpr float kMarginPixels = 0.5F;  // rounding must not cut the outermost pixel off

bool is_finite(const Body& body) {
  const Quaternion& q = body.rotation_world_body;
  return std::isfinite(body.center_world_m.x + body.center_world_m.y + body.center_world_m.z) &&
         std::isfinite(body.half_extent_m.x + body.half_extent_m.y + body.half_extent_m.z) &&
         std::isfinite(q.w + q.x + q.y + q.z);
}

std::array<std::uint8_t, 4> bytes(Rgb8 color) { return {color.r, color.g, color.b, 255}; }

/// False when no pixel can see the sphere.
bool cover(const Vec3d& center_m, double radius_m, const hal::Intrinsics& camera, const ClipRange& range,
           std::array<float, 4>& rectangle_ndc) {
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

}  // namespace

// The tangent slopes m solve (lateral - m z)^2 = r^2 (1 + m^2).
std::array<double, 2> tangent_slopes(double lateral_m, double z_m, double radius_m) noexcept {
  const double a = z_m * z_m - radius_m * radius_m;
  TACTUS_ASSERT(z_m > 0 && a > 0);
  const double half_width = radius_m * std::sqrt(lateral_m * lateral_m + a);
  return {(lateral_m * z_m - half_width) / a, (lateral_m * z_m + half_width) / a};
}

InstanceCounts build_instances(std::span<const Body> bodies, const T_WorldDepth& T_world_depth,
                               const hal::Intrinsics& camera, const ClipRange& range,
                               std::span<SphereInstance> spheres, std::span<BoxInstance> boxes) noexcept {
  InstanceCounts counts;
  const Transform<Depth, World> T_depth_world = T_world_depth.inverse();
  for (const Body& body : bodies) {
    if (!is_finite(body)) continue;
    const Vec3d center_m = T_depth_world * body.center_world_m;
    const bool is_sphere = body.shape == Shape::sphere;
    // A box is looked for inside the sphere around it; GL clips what of it is out of view.
    const double radius_m = static_cast<double>(is_sphere ? body.half_extent_m.x : body.half_extent_m.norm());
    std::array<float, 4> rectangle_ndc{};
    if (radius_m <= 0 || !cover(center_m, radius_m, camera, range, rectangle_ndc)) continue;

    if (is_sphere) {
      if (counts.spheres_count == spheres.size()) {
        ++counts.left_out_count;
        continue;
      }
      spheres[counts.spheres_count++] = {rectangle_ndc, center_m.cast<float>(), body.half_extent_m.x,
                                         bytes(body.color)};
    } else {
      if (counts.boxes_count == boxes.size()) {
        ++counts.left_out_count;
        continue;
      }
      const Rotation rotation = T_depth_world.rotation * Rotation::from(body.rotation_world_body);
      const auto axis = [&](int column, float half_m) {
        return Vec3d{rotation(0, column), rotation(1, column), rotation(2, column)}.cast<float>() * half_m;
      };
      boxes[counts.boxes_count++] = {
          {axis(0, body.half_extent_m.x), axis(1, body.half_extent_m.y), axis(2, body.half_extent_m.z)},
          center_m.cast<float>(),
          bytes(body.color)};
    }
  }
  return counts;
}

}  // namespace tactus::render
