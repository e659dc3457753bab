#include "hal/synthetic/depth_noise.hpp"

#include <algorithm>
#include <cmath>

#include "hal/synthetic/deterministic_math.hpp"
#include "hal/synthetic/options.hpp"

namespace tactus::hal::synthetic {
namespace {

using namespace noise_model;

std::uint16_t to_raw(double depth_m) {
  const double units = depth_m * (1 / kDepth_m_per_unit) + 0.5;
  return units >= 1 && units < 65536 ? static_cast<std::uint16_t>(units) : std::uint16_t{0};
}

struct Image {
  std::span<const float> depth_m;
  int width, height;
  [[nodiscard]] float at(int column, int row) const {
    return depth_m[static_cast<std::size_t>(row) * static_cast<std::size_t>(width) +
                   static_cast<std::size_t>(column)];
  }
};

bool is_edge(const Image& image, int column, int row, float z) {
  const float limit = static_cast<float>(kEdgeJump) * z;
  const auto jumps = [&](int c, int r) { return std::fabs(image.at(c, r) - z) > limit; };
  return jumps(std::max(column - 1, 0), row) || jumps(std::min(column + 1, image.width - 1), row) ||
         jumps(column, std::max(row - 1, 0)) || jumps(column, std::min(row + 1, image.height - 1));
}

/// Depth at a place between pixels: bilinear on a continuous surface, the nearest pixel's across an edge.
float depth_between(const Image& image, float column, float row, float z) {
  const float u = std::min(std::max(column, 0.0F), static_cast<float>(image.width - 1) - 0.001F);
  const float v = std::min(std::max(row, 0.0F), static_cast<float>(image.height - 1) - 0.001F);
  const int u0 = static_cast<int>(u), v0 = static_cast<int>(v);
  const float a = u - static_cast<float>(u0), b = v - static_cast<float>(v0);
  const float z00 = image.at(u0, v0), z10 = image.at(u0 + 1, v0), z01 = image.at(u0, v0 + 1),
              z11 = image.at(u0 + 1, v0 + 1);
  const float nearest = std::min(std::min(z00, z10), std::min(z01, z11));
  const float farthest = std::max(std::max(z00, z10), std::max(z01, z11));
  if (farthest - nearest > static_cast<float>(kEdgeJump) * z)
    return image.at(u0 + (a >= 0.5F ? 1 : 0), v0 + (b >= 0.5F ? 1 : 0));
  const float top = z00 + (z10 - z00) * a, bottom = z01 + (z11 - z01) * a;
  return top + (bottom - top) * b;
}

}  // namespace

void quantize_exact(std::span<const float> depth_m, std::span<std::uint16_t> raw) {
  for (std::size_t i = 0; i < depth_m.size(); ++i) raw[i] = to_raw(static_cast<double>(depth_m[i]));
}

void apply_depth_noise(const Scene& scene, const PixelRays& rays, const T_WorldDepth& T_world_depth,
                       std::span<const float> depth_m, std::span<const std::uint16_t> primitive,
                       std::uint64_t seed, int frame_index, std::span<std::uint16_t> raw) {
  const auto primitives = scene.primitives();
  const auto finishes = scene.finishes();
  const Image image{depth_m, rays.width(), rays.height()};
  const auto jitter_px = static_cast<float>(kLateral_px * rays.focal_px() / 525.0);
  const std::uint64_t stream = hash64(hash64(seed) + static_cast<std::uint64_t>(frame_index));
  const double shadow_px_m = rays.focal_px() * kBaseline_m;

  for (int row = 0; row < image.height; ++row) {
    // The projector sees pixel u at u - f b / z. Points in view order appear there in order, unless something
    // farther to the right reaches in front of them.
    double first_lit_px = 1e30;
    for (int column = image.width - 1; column >= 0; --column) {
      const std::size_t pixel = static_cast<std::size_t>(row) * static_cast<std::size_t>(image.width) +
                                static_cast<std::size_t>(column);
      raw[pixel] = 0;
      const float z = depth_m[pixel];
      if (z <= 0) continue;
      const double projector_px = column - shadow_px_m / static_cast<double>(z);
      const bool is_in_shadow = projector_px > first_lit_px + 0.5;
      first_lit_px = std::min(first_lit_px, projector_px);
      if (is_in_shadow || z < static_cast<float>(kZ_m_min) || z > static_cast<float>(kZ_m_max)) continue;

      const std::uint64_t key = stream + static_cast<std::uint64_t>(pixel) * 4;
      const std::uint64_t bits = hash64(key);
      if (is_edge(image, column, row, z) && uniform01(bits) < static_cast<float>(kEdgeLoss)) continue;

      const Primitive& solid = primitives[primitive[pixel]];
      const Material material = finishes[solid.finish].material;
      if (material == Material::glass || material == Material::mirror) {
        const auto patch = static_cast<std::uint64_t>(row / 4 * 4096 + column / 4);
        if (uniform01(hash64(stream ^ patch << 40)) >= static_cast<float>(kPaneReturn)) continue;
      }

      const double zd = static_cast<double>(z);
      const Vec3d ray{rays.x(column, row), rays.y(column, row), 1};
      const Vec3d p_local = solid.to_local(T_world_depth * (ray * zd));
      const Vec3d n_world = solid.R_local_world.transposed() * local_normal(solid, p_local);
      const double facing = n_world.dot(T_world_depth.rotation * ray);
      if (facing * facing < kGrazing_cosine * kGrazing_cosine * ray.dot(ray)) continue;

      const float jittered =
          depth_between(image, static_cast<float>(column) + jitter_px * gaussian(hash64(key + 1)),
                        static_cast<float>(row) + jitter_px * gaussian(hash64(key + 2)), z);
      const double base_m = static_cast<double>(jittered > 0 ? jittered : z);
      const double noisy_m = base_m + axial_sigma_m(base_m) * static_cast<double>(gaussian(hash64(key + 3)));
      const double steps = kRig_px_m / kDisparityStep_px / noisy_m;
      const double rounded = static_cast<double>(static_cast<std::int64_t>(steps + 0.5));
      raw[pixel] = to_raw(kRig_px_m / kDisparityStep_px / rounded);
    }
  }
}

}  // namespace tactus::hal::synthetic
