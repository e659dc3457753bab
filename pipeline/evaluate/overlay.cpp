#include "pipeline/evaluate/overlay.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "pipeline/evaluate/statistics.hpp"

namespace tactus::evaluate {
OverlayError overlay_error(std::span<const StampedPose> drawn, std::span<const StampedPose> true_poses,
                           const Alignment& T_true_drawn, const hal::Intrinsics& camera, double depth_m) {
  std::vector<double> errors_px;
  for (const PosePair& pair : associate(drawn, true_poses, rt::Duration{1'000'000})) {
    const Transform<Depth, World> T_depth_world = pair.truth.T_world_depth.inverse();
    double sum_px = 0;
    for (int row = 0; row < 3; ++row)
      for (int column = 0; column < 3; ++column) {
        const double u = (column + 0.5) / 3 * camera.width, v = (row + 0.5) / 3 * camera.height;
        const Vec3d p_drawn{(u - camera.cx) / camera.fx * depth_m, (v - camera.cy) / camera.fy * depth_m, depth_m};
        const Vec3d p = T_depth_world * (T_true_drawn * (pair.estimate.T_world_depth * p_drawn));
        const double du = p.x / p.z * camera.fx + camera.cx - u, dv = p.y / p.z * camera.fy + camera.cy - v;
        sum_px += std::sqrt(du * du + dv * dv);
      }
    errors_px.push_back(sum_px / 9);
  }
  OverlayError error;
  error.poses_count = errors_px.size();
  if (errors_px.empty()) return error;
  std::sort(errors_px.begin(), errors_px.end());
  error.p50_px = percentile_of_sorted(errors_px, 0.5);
  error.p95_px = percentile_of_sorted(errors_px, 0.95);
  error.max_px = errors_px.back();
  return error;
}

}  // namespace tactus::evaluate
