#include "pipeline/map/surface_cells.hpp"

#include <algorithm>
#include <cstring>

namespace tactus::map {
namespace {

constexpr unsigned kNear = 1, kBehind = 2, kFront = 4;

}  // namespace

// Most cells have neither; in bytes of a word a block takes 16 steps.
std::uint64_t cells_with_surface(const std::int16_t* tsdf, const MapConfig& config) noexcept {
  const auto band = static_cast<std::int32_t>(config.voxel_size_m / config.truncation_m * kTsdfScale);
  alignas(64) std::uint8_t sides[kBlockVoxels];
  for (int v = 0; v < kBlockVoxels; ++v) {
    const std::int32_t raw = tsdf[v];
    const unsigned near =
        static_cast<std::uint32_t>(raw + band) < static_cast<std::uint32_t>(2 * band) ? kNear : 0;
    const unsigned behind = raw < 0 ? kBehind : 0;
    const unsigned front = raw >= 0 ? kFront : 0;
    sides[v] = static_cast<std::uint8_t>(raw == kTsdfUnknown ? 0 : near | behind | front);
  }
  const auto row = [&sides](int y, int z) {
    std::uint64_t word;
    std::memcpy(&word, &sides[voxel_index(0, y, z)], 8);
    return word;
  };
  constexpr std::uint64_t kOnes = 0x0001'0001'0001'0001ull;  // one byte of each cell's two
  std::uint64_t cells = 0;
  for (int i = 0; i < 16; ++i) {
    const int y = kCellSide * (i & 3), z = kCellSide * (i >> 2);
    std::uint64_t any = row(y, z) | row(y + 1, z) | row(y, z + 1) | row(y + 1, z + 1);
    any |= any >> 8;
    const std::uint64_t hit = (any | (any >> 1 & any >> 2)) & kOnes;
    const std::uint64_t four = hit | hit >> 15 | hit >> 30 | hit >> 45;  // bits 0, 16, 32, 48 side by side
    cells |= (four & 15u) << (4 * i);
  }
  return cells;
}

bool surface_of_cell(const std::int16_t* tsdf, int cell, const MapConfig& config, CellSurface& out) noexcept {
  const int x = kCellSide * (cell & 3), y = kCellSide * (cell >> 2 & 3), z = kCellSide * (cell >> 4);
  float v[8] = {};
  int known = 0;
  float sum = 0, count = 0;
  for (int k = 0; k < 8; ++k) {
    const std::int16_t raw = tsdf[voxel_index(x + (k & 1), y + (k >> 1 & 1), z + (k >> 2))];
    if (raw == kTsdfUnknown) continue;
    known |= 1 << k;
    v[k] = static_cast<float>(raw);
    sum += v[k];
    count += 1;
  }
  float slope[3];
  for (int axis = 0; axis < 3; ++axis) {
    float difference = 0, pairs = 0;
    for (int k = 0; k < 8; ++k) {
      const int next = k | 1 << axis;
      if (next == k || (known >> k & 1) == 0 || (known >> next & 1) == 0) continue;
      difference += v[next] - v[k];
      pairs += 1;
    }
    slope[axis] = pairs > 0 ? difference / pairs : 0;
  }
  const Vec3f gradient{slope[0], slope[1], slope[2]};
  const float norm = gradient.norm();
  if (!(norm > 0)) return false;
  out.normal_world = gradient * (1 / norm);
  // The field may jump from one side's truncation to the other's across something thin; the surface of a cell
  // lies within reach of the cell.
  const float reach = 1.5f * config.voxel_size_m;
  const float distance_m = std::clamp(sum / count / kTsdfScale * config.truncation_m, -reach, reach);
  const Vec3f centre{static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f,
                     static_cast<float>(z) + 0.5f};
  out.foot_m = centre * config.voxel_size_m - out.normal_world * distance_m;
  return true;
}

}  // namespace tactus::map
