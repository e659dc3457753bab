#include <algorithm>
#include <cmath>
#include <cstring>

#include "pipeline/map/integrate_constants.hpp"
#include "pipeline/map/reciprocal.hpp"
#include "pipeline/register/depth_images.hpp"

namespace tactus::map {

IntegrationConstants::IntegrationConstants(const Map& map, const IntegrationFrame& frame) {
  const auto T_depth_world = frame.T_world_depth.inverse();
  const MapConfig& config = map.config();
  const auto size = static_cast<double>(config.voxel_size_m);
  constexpr double kUnits = 1.0 / static_cast<double>(kDepthUnitM);
  const double focal[3] = {frame.camera.fx * kUnits, frame.camera.fy * kUnits, kUnits};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) r[i * 3 + j] = focal[i] * T_depth_world.rotation.m[i * 3 + j] * size;
  }
  t[0] = focal[0] * T_depth_world.translation.x;
  t[1] = focal[1] * T_depth_world.translation.y;
  t[2] = focal[2] * T_depth_world.translation.z;
  const auto at = [&](double x, double y, std::size_t row) {
    return static_cast<float>(r[row * 3] * x + r[row * 3 + 1] * y);
  };
  for (int i = 0; i < 64; ++i) {
    offset_x[i] = at(i & 7, i >> 3, 0);
    offset_y[i] = at(i & 7, i >> 3, 1);
    offset_z[i] = at(i & 7, i >> 3, 2);
  }
  for (int i = 0; i < 16; ++i) {
    const double x = kCellSide * (i & 3) + 0.5, y = kCellSide * (i >> 2) + 0.5;
    cell_offset_x[i] = at(x, y, 0);
    cell_offset_y[i] = at(x, y, 1);
    cell_offset_z[i] = at(x, y, 2);
  }
  step_z = {static_cast<float>(r[2]), static_cast<float>(r[5]), static_cast<float>(r[8])};
  cx = static_cast<float>(frame.camera.cx);
  cy = static_cast<float>(frame.camera.cy);
  width = frame.camera.width;
  height = frame.camera.height;
  row_pixels = static_cast<float>(width);
  pixels = frame.image.pixels.data();
  tiles = frame.image.tiles.data();
  half_color = frame.half_color.empty() ? nullptr : frame.half_color.data();
  const float steps_per_unit = kTsdfScale * kDepthUnitM / config.truncation_m;
  cosine_to_steps = kTileCosineScale * steps_per_unit;
  color_band = 2.0f * config.voxel_size_m / config.truncation_m * kTsdfScale;
  behind_min = color_band;
  const float sigma_steps = kBehindSigmas / config.truncation_m * kTsdfScale;
  sigma_base = sigma_steps * depth_sigma_m(0.4f);
  sigma_slope = sigma_steps * (depth_sigma_m(1.4f) - depth_sigma_m(0.4f)) * kDepthUnitM * kDepthUnitM;
  frame_index = frame.index;

  // u >= 1 is x + (cx - 1) z >= 0, and so on.
  const double planes[5][3] = {{1, 0, frame.camera.cx - 1},
                               {-1, 0, width - 2 - frame.camera.cx},
                               {0, 1, frame.camera.cy - 1},
                               {0, -1, height - 2 - frame.camera.cy},
                               {0, 0, 1}};
  for (std::size_t k = 0; k < 5; ++k) {
    const double(&n)[3] = planes[k];
    double margin = k == 4 ? static_cast<double>(kNear) : 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {  // the block's corner that is least inside
      const double slope = n[0] * r[axis] + n[1] * r[3 + axis] + n[2] * r[6 + axis];
      margin += std::fmax(0.0, -slope * (kBlockSide - 1));
    }
    inside[k] = {static_cast<float>(n[0]), static_cast<float>(n[1]), static_cast<float>(n[2]),
                 static_cast<float>(margin)};
  }
}

BlockOrigin IntegrationConstants::origin_of(BlockKey key) const noexcept {
  const BlockCoord c = coord_of(key);
  const double x = kBlockSide * c.x, y = kBlockSide * c.y, z = kBlockSide * c.z;
  const auto row = [&](std::size_t i) {
    return static_cast<float>(r[i * 3] * x + r[i * 3 + 1] * y + r[i * 3 + 2] * z + t[i]);
  };
  return {{row(0), row(1), row(2)}};
}

bool IntegrationConstants::colors_due(const Map& map, BlockIndex block) const noexcept {
  if (half_color == nullptr) return false;
  return map.updates_count(block) == 0 || (frame_index + block) % kColorEveryFrames == 0;
}

namespace {

// Nearest pixel of a lattice point.
struct Projected {
  bool is_finite = false;
  float u_exact = 0, v_exact = 0;
  int u = 0, v = 0;
};

float inverse_of(float cell_z) { return scaled_reciprocal(cell_z) * (1.0f / kReciprocalScale); }
float inverse_near(float cell_inverse, float z) { return cell_inverse * (2.0f - z * cell_inverse); }

Projected project(const IntegrationConstants& c, const Vec3f& p, float inverse_z) {
  Projected out;
  out.u_exact = p.x * inverse_z + c.cx;
  out.v_exact = p.y * inverse_z + c.cy;
  out.is_finite = std::fabs(out.u_exact) < 1e6f && std::fabs(out.v_exact) < 1e6f;
  if (!out.is_finite) return out;
  out.u = static_cast<int>(std::nearbyint(out.u_exact));
  out.v = static_cast<int>(std::nearbyint(out.v_exact));
  return out;
}

struct Tile {
  float cosine = 0;         // TSDF steps per depth unit
  std::int32_t weight = 0;  // 1 to 32
  float behind = 0;         // where writing begins, TSDF steps
};

Tile tile_at(const IntegrationConstants& c, const Projected& p, float z) {
  const auto u = static_cast<std::size_t>(std::clamp(p.u, 0, c.width - 1)),
             v = static_cast<std::size_t>(std::clamp(p.v, 0, c.height - 1));
  const std::uint16_t word = c.tiles[(v >> 2) * static_cast<std::size_t>(c.width / 4) + (u >> 2)];
  const float off = z - 0.4f / kDepthUnitM;
  const float behind = std::fmax(c.behind_min, c.sigma_base + c.sigma_slope * (off * off));
  return {static_cast<float>(word & 0xFFu) * c.cosine_to_steps, word >> 8, -std::fmin(behind, kTsdfScale)};
}

struct Measured {
  bool hit = false;
  float distance = 0;
};

Measured measure(const IntegrationConstants& c, const Projected& p, float z, const Tile& tile) {
  Measured m;
  if (!(z > IntegrationConstants::kNear) || !p.is_finite) return m;
  if (p.u < 0 || p.v < 0 || p.u >= c.width || p.v >= c.height) return m;
  const std::uint32_t pixel =
      c.pixels[static_cast<std::size_t>(p.v) * static_cast<std::size_t>(c.width) + static_cast<std::size_t>(p.u)];
  const auto depth = static_cast<float>(pixel & 0xFFFFu);
  const auto slope_u = static_cast<float>(static_cast<std::int8_t>(pixel >> 16));
  const auto slope_v = static_cast<float>(static_cast<std::int8_t>(pixel >> 24));
  const float here = depth + slope_u * (p.u_exact - static_cast<float>(p.u)) +
                     slope_v * (p.v_exact - static_cast<float>(p.v));
  m.distance = (here - z) * tile.cosine;
  m.hit = depth > 0 && m.distance > tile.behind;
  return m;
}

Vec3f voxel_point(const IntegrationConstants& c, const BlockOrigin& origin, int voxel) {
  const int i = voxel & 63;
  const Vec3f row = origin.slice(c, voxel >> 6);
  return {row.x + c.offset_x[i], row.y + c.offset_y[i], row.z + c.offset_z[i]};
}

Vec3f cell_point(const IntegrationConstants& c, const BlockOrigin& origin, int cell) {
  const int i = cell & 15;
  const Vec3f row = origin.cell_slice(c, cell >> 4);
  return {row.x + c.cell_offset_x[i], row.y + c.cell_offset_y[i], row.z + c.cell_offset_z[i]};
}

bool voxels(const Map& map, BlockIndex block, const IntegrationConstants& c, BlockStaging& staging) {
  const BlockOrigin origin = c.origin_of(map.key(block));
  bool changed = false;
  std::memcpy(staging.tsdf, map.tsdf(block), sizeof staging.tsdf);
  std::memcpy(staging.weight, map.weight(block), sizeof staging.weight);
  for (int v = 0; v < kBlockVoxels; ++v) {
    const Vec3f p = voxel_point(c, origin, v);
    const int cell = cell_of_voxel(v & 7, v >> 3 & 7, v >> 6);
    const Vec3f centre = cell_point(c, origin, cell);
    const float centre_inverse = inverse_of(centre.z);
    const Tile tile = tile_at(c, project(c, centre, centre_inverse), centre.z);
    const Measured m = measure(c, project(c, p, inverse_near(centre_inverse, p.z)), p.z, tile);
    if (!m.hit) continue;
    changed = true;
    const float value = std::fmin(m.distance, kTsdfScale);
    const auto old_value = static_cast<float>(staging.tsdf[v]);
    const std::int32_t sum = staging.weight[v] + tile.weight;
    const float share = static_cast<float>(tile.weight) * (1.0f / kReciprocalScale) *
                        scaled_reciprocal(static_cast<float>(sum));
    staging.tsdf[v] = static_cast<std::int16_t>(
        std::fmin(std::nearbyint(old_value + (value - old_value) * share), kTsdfScale));
    staging.weight[v] = static_cast<std::uint8_t>(std::min(sum, IntegrationConstants::kWeightMax));
  }
  return changed;
}

void colors(const Map& map, BlockIndex block, const IntegrationConstants& c, BlockStaging& staging) {
  const BlockOrigin origin = c.origin_of(map.key(block));
  for (int cell = 0; cell < kBlockCells; ++cell) {
    const Vec3f point = cell_point(c, origin, cell);
    const Projected p = project(c, point, inverse_of(point.z));
    const Measured m = measure(c, p, point.z, tile_at(c, p, point.z));
    if (!m.hit || !(std::fabs(m.distance) < c.color_band)) continue;
    const std::uint32_t seen = c.half_color[static_cast<std::size_t>(p.v >> 1) * static_cast<std::size_t>(c.width / 2) +
                                               static_cast<std::size_t>(p.u >> 1)];
    if (seen >> 24 == 0) continue;
    ColorCell& color = staging.color[cell];
    const auto weight = static_cast<float>(color.weight);
    const float share = scaled_reciprocal(weight + 1.0f) * (1.0f / kReciprocalScale);
    const auto blend = [&](std::uint8_t& channel, std::uint32_t to) {
      const auto from = static_cast<float>(channel);
      channel =
          static_cast<std::uint8_t>(std::nearbyint(from + (static_cast<float>(to & 0xFFu) - from) * share));
    };
    blend(color.r, seen);
    blend(color.g, seen >> 8);
    blend(color.b, seen >> 16);
    color.weight = static_cast<std::uint8_t>(std::fmin(weight + 1.0f, IntegrationConstants::kColorWeightMax));
  }
}

}  // namespace

void integrate_blocks_reference(Map& map, const IntegrationFrame& frame,
                                std::span<const BlockIndex> blocks) noexcept {
  const IntegrationConstants c(map, frame);
  BlockStaging staging;
  for (const BlockIndex block : blocks) {
    if (!c.voxels_due(map, block) || !voxels(map, block, c, staging)) continue;
    std::memcpy(staging.color, map.color(block), sizeof staging.color);
    if (c.colors_due(map, block)) colors(map, block, c, staging);
    map.publish(block, staging);
  }
}

}  // namespace tactus::map
