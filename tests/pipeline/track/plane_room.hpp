// Views of a few planes, in closed form: what tracking is tested against without a map.
#pragma once

#include <cmath>
#include <cstdlib>
#include <memory>
#include <vector>

#include "pipeline/map/predict.hpp"
#include "pipeline/track/icp.hpp"

namespace tactus::track::test {

/// n . x = offset, the normal towards the camera.
struct Plane {
  Vec3d normal;
  double offset;
};

inline Plane plane_through(const Vec3d& point, const Vec3d& normal) {
  const Vec3d n = normal.normalized();
  return {n, n.dot(point)};
}

/// A floor and two walls.
inline std::vector<Plane> corner() {
  return {plane_through({0, 0.8, 2}, {0.05, -1, -0.1}), plane_through({-0.9, 0, 2}, {1, 0.1, -0.6}),
          plane_through({0.3, 0, 2.4}, {-0.5, 0.05, -1})};
}

inline std::vector<Plane> wall(const Vec3d& normal = {0, 0, -1}) {
  return {plane_through({0, 0, 2}, normal)};
}

inline hal::Intrinsics half_camera() {
  hal::Intrinsics camera;
  camera.width = 160;
  camera.height = 120;
  camera.fx = camera.fy = 131.25;
  camera.cx = 79.5;
  camera.cy = 59.5;
  return camera;
}

/// The first plane along the ray `direction` from `from`; the factor of `direction`, 0 when none. `normal`
/// may be null.
inline double meet(const std::vector<Plane>& planes, const Vec3d& from, const Vec3d& direction,
                   Vec3d* normal) {
  double nearest = 0;
  for (const Plane& plane : planes) {
    const double slope = plane.normal.dot(direction);
    if (!(slope < -0.05)) continue;
    const double along = (plane.offset - plane.normal.dot(from)) / slope;
    if (along > 0 && (nearest == 0 || along < nearest)) {
      nearest = along;
      if (normal != nullptr) *normal = plane.normal;
    }
  }
  return nearest;
}

/// The planes as the camera at T_view_live sees them, half-resolution depth.
inline std::vector<float> live_view(const std::vector<Plane>& planes, const T_ViewLive& T_view_live) {
  const auto camera = half_camera();
  std::vector<float> z_m;
  for (int v = 0; v < camera.height; ++v)
    for (int u = 0; u < camera.width; ++u)
      z_m.push_back(static_cast<float>(
          meet(planes, T_view_live.translation,
               T_view_live.rotation * Vec3d{(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1},
               nullptr)));
  return z_m;
}

/// The planes as a model view at identity.
class ModelOfPlanes {
 public:
  explicit ModelOfPlanes(const std::vector<Plane>& planes) {
    const auto camera = half_camera();
    bytes_ = rt::round_up(map::ModelView::bytes_needed(camera.width, camera.height), 64);
    memory_.reset(static_cast<std::byte*>(std::aligned_alloc(64, bytes_)));
    rt::Slice slice({memory_.get(), bytes_});
    view.bind(slice, camera);
    for (int v = 0; v < camera.height; ++v)
      for (int u = 0; u < camera.width; ++u) {
        Vec3d n;
        const double z = meet(planes, {}, {(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1}, &n);
        const auto i = static_cast<std::size_t>(v * camera.width + u);
        view.z_m[i] = static_cast<float>(z);
        view.nx[i] = static_cast<float>(n.x);
        view.ny[i] = static_cast<float>(n.y);
        view.nz[i] = static_cast<float>(n.z);
      }
  }
  map::ModelView view;

 private:
  struct Free {
    void operator()(std::byte* p) const { std::free(p); }
  };
  std::size_t bytes_ = 0;
  std::unique_ptr<std::byte, Free> memory_;
};

/// Rotation by a small vector, and a shift.
inline T_ViewLive motion(const Vec3d& turn, const Vec3d& shift) {
  return {Rotation::from(Quaternion{1, turn.x / 2, turn.y / 2, turn.z / 2}.normalized()), shift};
}

}  // namespace tactus::track::test
