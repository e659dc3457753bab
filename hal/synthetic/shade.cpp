#include "hal/synthetic/shade.hpp"

#include <algorithm>

namespace tactus::hal::synthetic {
namespace {

float light_at(const Scene& scene, const Vec3d& p, const Vec3d& n) {
  constexpr double kFallOff = 1.0 / 9.0;  // 1 / (3 m)^2
  const float open = 0.45F + 0.55F * scene.openness(p, n);
  float sum = open * (0.42F + 0.10F * static_cast<float>(n.y));
  for (const Light& light : scene.lights()) {
    const Vec3d to_light = light.position_world_m - p;
    const double d2 = to_light.dot(to_light);
    const double cosine = std::max(n.dot(to_light), 0.0) / std::sqrt(d2);
    // A share of the light comes round the edges, so that nothing turns black.
    const double soft = 0.15 + 0.85 * cosine;
    sum += open * light.strength * static_cast<float>(soft / (1 + d2 * kFallOff));
  }
  return sum;
}

std::uint8_t lit(std::uint8_t albedo, float light) {
  const float v = static_cast<float>(albedo) * light;
  // Compresses the highlights above 200 instead of cutting them off.
  const float w = v < 200.0F ? v : 200.0F + (v - 200.0F) * 55.0F / (v - 145.0F);
  return static_cast<std::uint8_t>(w + 0.5F);
}

}  // namespace

void shade(const Scene& scene, const PixelRays& rays, const T_WorldDepth& T_world_camera,
           std::span<const float> depth_m, std::span<const std::uint16_t> primitive,
           std::span<std::uint8_t> rgb) {
  const auto primitives = scene.primitives();
  const auto finishes = scene.finishes();
  const double m_per_px_at_1m = 1 / rays.focal_px();
  std::size_t pixel = 0;
  for (int row = 0; row < rays.height(); ++row)
    for (int column = 0; column < rays.width(); ++column, ++pixel) {
      std::uint8_t* out = rgb.data() + pixel * 3;
      if (primitive[pixel] == kNoPrimitive) {
        out[0] = out[1] = out[2] = 0;
        continue;
      }
      const Primitive& solid = primitives[primitive[pixel]];
      const double z = static_cast<double>(depth_m[pixel]);
      const Vec3d p = T_world_camera * Vec3d{rays.x(column, row) * z, rays.y(column, row) * z, z};
      const Vec3d p_local = solid.to_local(p);
      const Vec3d n_local = local_normal(solid, p_local);
      const Vec3d n = solid.R_local_world.transposed() * n_local;
      const Rgb8 albedo = surface_color(scene, solid, p_local, n_local, z * m_per_px_at_1m);
      const float emission = finishes[solid.finish].emission;
      const float light = emission >= 1 ? 1.0F : emission + (1 - emission) * light_at(scene, p, n);
      out[0] = lit(albedo.r, light);
      out[1] = lit(albedo.g, light);
      out[2] = lit(albedo.b, light);
    }
}

}  // namespace tactus::hal::synthetic
