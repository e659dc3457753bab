// Reading the distance field on the writer's side (no validation needed: nobody else writes).
#pragma once

#include <cmath>

#include "pipeline/map/map.hpp"

namespace tactus::map {

/// Trilinear value and gradient at a point of the lattice (voxel units), in truncations and truncations per
/// voxel. False when any of the eight voxels around is unobserved.
inline bool sample_field(const Map& map, float x, float y, float z, float& value, Vec3f& gradient) noexcept {
  const float floor_x = std::floor(x), floor_y = std::floor(y), floor_z = std::floor(z);
  const auto ix = static_cast<std::int32_t>(floor_x), iy = static_cast<std::int32_t>(floor_y),
             iz = static_cast<std::int32_t>(floor_z);
  const BlockIndex block = map.find(key_of({block_of(ix), block_of(iy), block_of(iz)}));
  if (block == kNoBlock) return false;
  const BlockIndex* neighbours = map.neighbours(block);
  const int lx = in_block(ix), ly = in_block(iy), lz = in_block(iz);
  float v[8];
  for (int corner = 0; corner < 8; ++corner) {
    const int cx = lx + (corner & 1), cy = ly + (corner >> 1 & 1), cz = lz + (corner >> 2);
    const BlockIndex b = neighbours[(cx >> 3) | (cy >> 3) << 1 | (cz >> 3) << 2];
    if (b == kNoBlock) return false;
    const std::int16_t raw = map.tsdf(b)[voxel_index(cx & 7, cy & 7, cz & 7)];
    if (raw == kTsdfUnknown) return false;
    v[corner] = static_cast<float>(raw);
  }
  const float tx = x - floor_x, ty = y - floor_y, tz = z - floor_z;
  const auto lerp = [](float a, float b, float t) { return a + (b - a) * t; };
  const float d00 = v[1] - v[0], d10 = v[3] - v[2], d01 = v[5] - v[4], d11 = v[7] - v[6];
  const float c00 = v[0] + d00 * tx, c10 = v[2] + d10 * tx, c01 = v[4] + d01 * tx, c11 = v[6] + d11 * tx;
  const float e0 = c10 - c00, e1 = c11 - c01;
  const float c0 = c00 + e0 * ty, c1 = c01 + e1 * ty;
  constexpr float kScale = 1.0f / kTsdfScale;
  value = lerp(c0, c1, tz) * kScale;
  gradient = {lerp(lerp(d00, d10, ty), lerp(d01, d11, ty), tz) * kScale, lerp(e0, e1, tz) * kScale,
              (c1 - c0) * kScale};
  return true;
}

}  // namespace tactus::map
