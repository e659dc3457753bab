#include <cmath>

#include "pipeline/track/icp_rules.hpp"

namespace tactus::track {

IcpSums icp_accumulate_reference(const IcpInput& input, const T_ViewLive& T_view_live, const IcpLevel& level,
                                 int chunk) noexcept {
  IcpSums sums;
  const auto& model = *input.model;
  const auto& camera = model.camera;
  const auto T_live_view = T_view_live.inverse();
  const int row_begin = chunk * kIcpRowsPerChunk * level.stride;
  const int row_end = std::min(camera.height, row_begin + kIcpRowsPerChunk * level.stride);
  for (int row = row_begin; row < row_end; row += level.stride)
    for (int column = 0; column < camera.width; column += level.stride) {
      const auto at = static_cast<std::size_t>(row) * static_cast<std::size_t>(camera.width) +
                      static_cast<std::size_t>(column);
      const auto z = static_cast<double>(model.z_m[at]);
      if (!(z > 0)) continue;
      const Vec3d p{(column - camera.cx) / camera.fx * z, (row - camera.cy) / camera.fy * z, z};
      const Vec3d l = T_live_view * p;
      if (!(l.z > static_cast<double>(IcpConstants::kNearM))) continue;
      const double u = std::nearbyint(l.x / l.z * camera.fx + camera.cx);
      const double v = std::nearbyint(l.y / l.z * camera.fy + camera.cy);
      if (u < 0 || v < 0 || u >= camera.width || v >= camera.height) continue;
      sums.model_count += 1;
      const auto depth = static_cast<double>(
          input.live_m[static_cast<std::size_t>(v) * static_cast<std::size_t>(camera.width) +
                       static_cast<std::size_t>(u)]);
      if (!(depth > 0)) continue;
      sums.candidates_count += 1;
      const Vec3d q = T_view_live *
                      Vec3d{(u - camera.cx) / camera.fx * depth, (v - camera.cy) / camera.fy * depth, depth};
      const Vec3d e = q - p;
      if (!(e.dot(e) < static_cast<double>(level.distance_m_max) * static_cast<double>(level.distance_m_max)))
        continue;
      sums.inliers_count += 1;
      const Vec3d n{static_cast<double>(model.nx[at]), static_cast<double>(model.ny[at]),
                    static_cast<double>(model.nz[at])};
      if (!(n.z < 0)) continue;
      const double r = n.dot(e);
      const double off = depth - 0.4;
      const double sigma = static_cast<double>(IcpConstants::kSigmaBaseM) +
                           static_cast<double>(IcpConstants::kSigmaSlope) * off * off;
      const double limit = static_cast<double>(IcpConstants::kHuberSigmas) * sigma;
      const double w = std::fabs(r) > limit ? limit / std::fabs(r) : 1.0;
      const Vec3d lever{q.x, q.y, q.z - static_cast<double>(input.pivot_z_m)};
      const Vec3d turn = lever.cross(n);
      const double j[6] = {turn.x, turn.y, turn.z, n.x, n.y, n.z};
      std::size_t k = 0;
      for (std::size_t i = 0; i < 6; ++i) {
        for (std::size_t m = i; m < 6; ++m) sums.h[k++] += w * j[i] * j[m];
        sums.b[i] += w * r * j[i];
      }
      sums.weighted_residual2 += w * r * r;
      sums.weight += w;
    }
  return sums;
}

}  // namespace tactus::track
