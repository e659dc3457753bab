#include "hal/synthetic/depth_noise.hpp"

#include <algorithm>
#include <array>

#include "hal/synthetic/deterministic_math.hpp"
#include "hal/synthetic/options.hpp"
#include "hal/synthetic/pixel_kernels.hpp"

namespace tactus::hal::synthetic {
namespace {

NoiseStreams streams_of(std::uint64_t seed, int frame_index) {
  const std::uint64_t frame = hash64(hash64(seed) + static_cast<std::uint64_t>(frame_index));
  const auto stream = [&](std::uint64_t i) { return static_cast<std::uint32_t>(hash64(frame + i) >> 32); };
  return {stream(0), stream(1), stream(2), stream(3), stream(4), stream(5)};
}

}  // namespace

void quantize_exact(std::span<const float> depth_m, std::span<std::uint16_t> raw) {
  for (std::size_t i = 0; i < depth_m.size(); ++i) {
    const double units = static_cast<double>(depth_m[i]) * (1 / kDepth_m_per_unit) + 0.5;
    raw[i] = units >= 1 && units < 65536 ? static_cast<std::uint16_t>(units) : std::uint16_t{0};
  }
}

void apply_depth_noise(const Scene& scene, const PixelRays& rays, const T_WorldDepth& T_world_depth,
                       const Hits& hits, std::uint64_t seed, int frame_index, std::span<std::uint16_t> raw) {
  const auto primitives = scene.primitives();
  const auto finishes = scene.finishes();
  const auto width = static_cast<std::size_t>(rays.width());
  const auto shadow_px_m = static_cast<float>(rays.focal_px() * noise_model::kBaseline_m);
  NoiseRow row;
  row.width = rays.width();
  row.height = rays.height();
  row.jitter_px = static_cast<float>(noise_model::kLateral_px * rays.focal_px() / 525.0);
  row.streams = streams_of(seed, frame_index);
  for (std::size_t i = 0; i < 9; ++i) row.R_world_depth[i] = static_cast<float>(T_world_depth.rotation.m[i]);

  PixelRow row_rays;
  alignas(64) std::array<std::uint32_t, kRowCapacity> flags{};
  for (; row.row < row.height; ++row.row) {
    const std::size_t first = static_cast<std::size_t>(row.row) * width;
    rays.copy_row(row.row, std::span(row_rays.x).first(width), std::span(row_rays.y).first(width));
    // The projector sees pixel u at u - f b / z. Points in view order appear there in order, unless something
    // farther to the right reaches in front of them.
    float first_lit_px = 1e9F;
    for (std::size_t column = width; column-- > 0;) {
      flags[column] = 0;
      const std::size_t pixel = first + column;
      const float z = hits.depth_m[pixel];
      if (z <= 0) continue;
      const float projector_px = static_cast<float>(column) - shadow_px_m / z;
      if (projector_px > first_lit_px + 0.5F) flags[column] |= kShadowed;
      first_lit_px = std::min(first_lit_px, projector_px);
      const Material material = finishes[primitives[hits.primitive[pixel]].finish].material;
      if (material == Material::glass || material == Material::mirror) flags[column] |= kPane;
    }
    noise_row(row, row_rays, hits, flags, raw.subspan(first, width));
  }
}

}  // namespace tactus::hal::synthetic
