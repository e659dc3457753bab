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
      const auto add = [&](const Vec3d& direction, double w, double r) {
        const Vec3d turn = Vec3d{q.x, q.y, q.z - static_cast<double>(input.pivot_z_m)}.cross(direction);
        const double j[6] = {turn.x, turn.y, turn.z, direction.x, direction.y, direction.z};
        std::size_t k = 0;
        for (std::size_t i = 0; i < 6; ++i) {
          for (std::size_t m = i; m < 6; ++m) sums.h[k++] += w * j[i] * j[m];
          sums.b[i] += w * r * j[i];
        }
      };
      if (!input.model_brightness.empty() && !input.live_luma.empty()) {
        const double fu = l.x / l.z * camera.fx + camera.cx, fv = l.y / l.z * camera.fy + camera.cy;
        const BrightnessWord word = input.model_brightness[at];
        if (word != 0 && fu > 0 && fv > 0 && fu < camera.width - 1 && fv < camera.height - 1) {
          const auto width = static_cast<std::size_t>(camera.width);
          const double u0 = std::floor(fu), v0 = std::floor(fv), tu = fu - u0, tv = fv - v0;
          const std::size_t corner = static_cast<std::size_t>(v0) * width + static_cast<std::size_t>(u0);
          const double live[4] = {
              static_cast<double>(input.live_luma[corner]), static_cast<double>(input.live_luma[corner + 1]),
              static_cast<double>(input.live_luma[corner + width]),
              static_cast<double>(input.live_luma[corner + width + 1])};
          const double top = live[0] + (live[1] - live[0]) * tu, bottom = live[2] + (live[3] - live[2]) * tu;
          const auto bits = static_cast<std::int32_t>(word);
          const double along_u = bits << 11 >> 21, along_v = bits >> 21;
          const double r_grey = top + (bottom - top) * tv - 0.25 * static_cast<double>(word & 0x3FFu);
          if (*std::min_element(live, live + 4) > 0 &&
              std::fabs(r_grey) < static_cast<double>(IcpConstants::kGreyGate)) {
            const double limit = static_cast<double>(IcpConstants::kGreyHuber);
            const double w = std::fabs(r_grey) > limit ? limit / std::fabs(r_grey) : 1.0;
            const double scale = static_cast<double>(IcpConstants::kGradientScale);
            const double gx = scale * along_u * camera.fx / z, gy = scale * along_v * camera.fy / z;
            add({gx, gy, -(gx * p.x + gy * p.y) / z}, w,
                r_grey * static_cast<double>(IcpConstants::kMetresPerGrey));
          }
        }
      }
      if (!(n.z < 0)) continue;
      const double r = n.dot(e);
      const double off = depth - 0.4;
      const double sigma = static_cast<double>(IcpConstants::kSigmaBaseM) +
                           static_cast<double>(IcpConstants::kSigmaSlope) * off * off;
      const double limit = static_cast<double>(IcpConstants::kHuberSigmas) * sigma;
      const double w = std::fabs(r) > limit ? limit / std::fabs(r) : 1.0;
      add(n, w, r);
      sums.weighted_residual2 += w * r * r;
      sums.weight += w;
    }
  return sums;
}

}  // namespace tactus::track
