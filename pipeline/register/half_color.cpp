#include "pipeline/register/half_color.hpp"

#include <algorithm>
#include <cmath>

#include "rt/assert.hpp"

namespace tactus {
namespace {

// A surface this much farther than the nearest one in its bin is hidden: 4 cm or 3 % of the distance.
constexpr float occlusion_tolerance_m(float z) { return std::max(0.04f, 0.03f * z); }

struct ColorProjection {
  float m[12];  // colour from depth camera
  float fx, fy, cx, cy;
};

}  // namespace

Normalized distort(const hal::Intrinsics& camera, Normalized ideal) noexcept {
  const auto k1 = static_cast<float>(camera.k1), k2 = static_cast<float>(camera.k2),
             k3 = static_cast<float>(camera.k3);
  const auto p1 = static_cast<float>(camera.p1), p2 = static_cast<float>(camera.p2);
  const float x = ideal.x, y = ideal.y, r2 = x * x + y * y;
  const float radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3));
  return {x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
          y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y};
}

Normalized undistort(const hal::Intrinsics& camera, Normalized distorted) noexcept {
  Normalized ideal = distorted;
  for (int i = 0; i < 8; ++i) {
    const Normalized again = distort(camera, ideal);
    ideal = {ideal.x + (distorted.x - again.x), ideal.y + (distorted.y - again.y)};
  }
  return ideal;
}

void half_color_registered(std::span<const std::uint8_t> rgb, int width, int height,
                           std::span<PackedColor> half_color) noexcept {
  const auto w = static_cast<std::size_t>(width), h = static_cast<std::size_t>(height);
  TACTUS_ASSERT(rgb.size() == w * h * 3 && half_color.size() == w * h / 4);
  for (std::size_t y = 0; y < h / 2; ++y) {
    const std::uint8_t* above = &rgb[2 * y * w * 3];
    const std::uint8_t* below = above + w * 3;
    PackedColor* out = &half_color[y * (w / 2)];
    for (std::size_t x = 0; x < w / 2; ++x, above += 6, below += 6) {
      const auto mean = [&](int c) {
        return static_cast<std::uint32_t>(above[c] + above[c + 3] + below[c] + below[c + 3] + 2) >> 2;
      };
      out[x] = mean(0) | mean(1) << 8 | mean(2) << 16 | 0xFF000000u;
    }
  }
}

void half_color_projected(std::span<const std::uint8_t> rgb, const hal::RigCalibration& rig,
                          std::span<const float> half_m, const hal::Intrinsics& half_camera,
                          std::span<float> nearest_z_m, std::span<PackedColor> half_color,
                          std::span<std::uint32_t> color_pixel) noexcept {
  const hal::Intrinsics& color = rig.color;
  const int bins_x = color.width / kColorBinPixels + 1;
  std::fill(nearest_z_m.begin(), nearest_z_m.end(), 1e9f);
  ColorProjection p;
  const double translation[3] = {rig.T_color_depth.translation.x, rig.T_color_depth.translation.y,
                                 rig.T_color_depth.translation.z};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j)
      p.m[i * 4 + j] = static_cast<float>(rig.T_color_depth.rotation.m[i * 3 + j]);
    p.m[i * 4 + 3] = static_cast<float>(translation[i]);
  }
  p.fx = static_cast<float>(color.fx);
  p.fy = static_cast<float>(color.fy);
  p.cx = static_cast<float>(color.cx);
  p.cy = static_cast<float>(color.cy);
  const bool distorted = color.has_distortion();
  const float inverse_fx = 1.0f / static_cast<float>(half_camera.fx),
              inverse_fy = 1.0f / static_cast<float>(half_camera.fy);
  const auto cx = static_cast<float>(half_camera.cx), cy = static_cast<float>(half_camera.cy);

  // First pass: where each point falls, and the nearest depth of each bin. Second: who is visible.
  const auto lift = [&](int x, int y, float z, int& u, int& v) {
    const float px = (static_cast<float>(x) - cx) * inverse_fx * z,
                py = (static_cast<float>(y) - cy) * inverse_fy * z;
    const float qx = p.m[0] * px + p.m[1] * py + p.m[2] * z + p.m[3];
    const float qy = p.m[4] * px + p.m[5] * py + p.m[6] * z + p.m[7];
    const float qz = p.m[8] * px + p.m[9] * py + p.m[10] * z + p.m[11];
    if (!(qz > 0.05f)) return -1.0f;
    Normalized n{qx / qz, qy / qz};
    // Brown's polynomial folds back far outside the image; a point that the ideal pinhole puts a third of the
    // width outside is not in view.
    if (!(std::fabs(n.x * p.fx) < static_cast<float>(color.width) &&
          std::fabs(n.y * p.fy) < static_cast<float>(color.height)))
      return -1.0f;
    if (distorted) n = distort(color, n);
    const float fu = n.x * p.fx + p.cx + 0.5f, fv = n.y * p.fy + p.cy + 0.5f;
    if (!(fu >= 0 && fv >= 0 && fu < static_cast<float>(color.width) &&
          fv < static_cast<float>(color.height)))
      return -1.0f;
    u = static_cast<int>(fu);
    v = static_cast<int>(fv);
    return qz;
  };
  std::size_t pixel = 0;
  for (int y = 0; y < half_camera.height; ++y)
    for (int x = 0; x < half_camera.width; ++x, ++pixel) {
      color_pixel[pixel] = kNoColorPixel;
      half_color[pixel] = 0;
      const float z = half_m[pixel];
      if (!(z > 0)) continue;
      int u = 0, v = 0;
      const float qz = lift(x, y, z, u, v);
      if (qz < 0) continue;
      color_pixel[pixel] = static_cast<std::uint32_t>(v) << 16 | static_cast<std::uint32_t>(u);
      float& nearest =
          nearest_z_m[static_cast<std::size_t>(v / kColorBinPixels) * static_cast<std::size_t>(bins_x) +
                      static_cast<std::size_t>(u / kColorBinPixels)];
      nearest = std::min(nearest, qz);
    }
  for (pixel = 0; pixel < half_m.size(); ++pixel) {
    const std::uint32_t at = color_pixel[pixel];
    if (at == kNoColorPixel) continue;
    int ignored_u = 0, ignored_v = 0;
    const float qz = lift(static_cast<int>(pixel % static_cast<std::size_t>(half_camera.width)),
                          static_cast<int>(pixel / static_cast<std::size_t>(half_camera.width)),
                          half_m[pixel], ignored_u, ignored_v);
    const auto u = static_cast<std::size_t>(at & 0xFFFFu), v = static_cast<std::size_t>(at >> 16);
    const float nearest =
        nearest_z_m[v / kColorBinPixels * static_cast<std::size_t>(bins_x) + u / kColorBinPixels];
    if (qz > nearest + occlusion_tolerance_m(nearest)) {
      color_pixel[pixel] = kNoColorPixel;
      continue;
    }
    const std::uint8_t* c = &rgb[(v * static_cast<std::size_t>(color.width) + u) * 3];
    half_color[pixel] = static_cast<PackedColor>(c[0]) | static_cast<PackedColor>(c[1]) << 8 |
                        static_cast<PackedColor>(c[2]) << 16 | 0xFF000000u;
  }
}

}  // namespace tactus
