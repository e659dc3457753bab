// Real surfaces in closed form, for tests: what a depth camera sees of a floor, a wall, a box.
#pragma once

#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "hal/calibration.hpp"
#include "hal/transform.hpp"

namespace tactus::test {

inline Vec3d pixel_ray(const hal::Intrinsics& camera, double u, double v) {
  return {(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1};
}

/// A camera at `eye` that looks at `target`, world y up.
inline T_WorldDepth look_at(const Vec3d& eye, const Vec3d& target) {
  const Vec3d forward = (target - eye).normalized();
  const Vec3d right = forward.cross({0, 1, 0}).normalized(), down = forward.cross(right);
  return {{{right.x, down.x, forward.x, right.y, down.y, forward.y, right.z, down.z, forward.z}}, eye};
}

struct Plane {
  Vec3d normal;         // unit, world
  double offset_m = 0;  // points p with normal . p = offset
};

/// Depth image of the nearest of some planes; 0 where none is seen.
inline std::vector<float> depth_of_planes(const hal::Intrinsics& camera, const T_WorldDepth& T_world_depth,
                                          std::span<const Plane> planes) {
  std::vector<float> depth_m;
  for (int v = 0; v < camera.height; ++v)
    for (int u = 0; u < camera.width; ++u) {
      const Vec3d ray = T_world_depth.rotation * pixel_ray(camera, u, v);
      double nearest = std::numeric_limits<double>::infinity();
      for (const Plane& plane : planes) {
        const double z =
            (plane.offset_m - plane.normal.dot(T_world_depth.translation)) / plane.normal.dot(ray);
        if (z > 0.01 && z < nearest) nearest = z;
      }
      depth_m.push_back(nearest < 50 ? static_cast<float>(nearest) : 0.0F);
    }
  return depth_m;
}

/// Whether a ray from `start` (world) meets a sphere, and a box about the origin of its frame, ahead of it.
inline bool meets_sphere(const Vec3d& start, const Vec3d& direction, const Vec3d& center, double radius_m) {
  const Vec3d d = direction.normalized(), offset = center - start;
  const double along = offset.dot(d);
  return along > 0 && offset.dot(offset) - along * along < radius_m * radius_m;
}
inline bool meets_box(const Vec3d& start, const Vec3d& direction, const Vec3d& center, const Vec3d& half_m) {
  double enter = 0, leave = 1e9;
  const double s[3] = {start.x - center.x, start.y - center.y, start.z - center.z};
  const double d[3] = {direction.x, direction.y, direction.z}, h[3] = {half_m.x, half_m.y, half_m.z};
  for (int i = 0; i < 3; ++i) {
    const double a = (-h[i] - s[i]) / d[i], b = (h[i] - s[i]) / d[i];
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  return enter < leave;
}

/// Pixels whose whole neighbourhood of +- margin has one value: 1 inside, 0 outside, else -1.
inline std::vector<int> without_band(const std::vector<bool>& mask, int width, int height, int margin) {
  std::vector<int> sure(mask.size(), -1);
  for (int v = 0; v < height; ++v)
    for (int u = 0; u < width; ++u) {
      int inside = 0, outside = 0;
      for (int y = std::max(0, v - margin); y <= std::min(height - 1, v + margin); ++y)
        for (int x = std::max(0, u - margin); x <= std::min(width - 1, u + margin); ++x)
          ++(mask[static_cast<std::size_t>(y * width + x)] ? inside : outside);
      if (inside == 0 || outside == 0) sure[static_cast<std::size_t>(v * width + u)] = inside > 0 ? 1 : 0;
    }
  return sure;
}

}  // namespace tactus::test
