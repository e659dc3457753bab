// The units of the labelled map: voxels in 8x8x8 blocks, cells of 2x2x2 voxels, and the keys that name
// blocks.
//
// A voxel's centre lies at (i, j, k) * voxel_size_m in the world; block (x, y, z) holds voxels 8x .. 8x+7 and
// so on. In a block voxels and cells are stored x fastest, then y, then z.
//
//   per voxel   tsdf int16 + weight uint8                     3     bytes
//   per cell    colour 4, label distribution 8, refined 3 (/ 8)   1.875 bytes a voxel
//   per block   header 32, hash 16, lists 6 (/ 512)           0.11  bytes a voxel      together <= 5
#pragma once

#include <cstddef>
#include <cstdint>

#include "hal/transform.hpp"

namespace tactus::map {

inline constexpr int kBlockSide = 8;  // voxels
inline constexpr int kBlockVoxels = 512;
inline constexpr int kCellSide = 2;  // voxels
inline constexpr int kBlockCellSide = kBlockSide / kCellSide;
inline constexpr int kBlockCells = 64;

/// Signed distance in units of truncation / 32767. Positive in front of the surface.
inline constexpr float kTsdfScale = 32767.0f;
inline constexpr std::int16_t kTsdfUnknown = -32768;  // never observed; its weight is 0

struct BlockCoord {
  std::int32_t x = 0, y = 0, z = 0;
  friend constexpr bool operator==(const BlockCoord&, const BlockCoord&) = default;
};

/// A block's coordinates in 32 bits: x and z 11 bits each, y (up) 10. At 1 cm voxels +-82 m by +-41 m by +-82
/// m.
using BlockKey = std::uint32_t;
inline constexpr BlockKey kNoKey = 0xFFFFFFFFu;
inline constexpr int kKeyBiasXZ = 1024;
inline constexpr int kKeyBiasY = 512;

/// kNoKey when the coordinates are out of the map's extent. y = 511 is out, so that no block has kNoKey.
constexpr BlockKey key_of(const BlockCoord& c) {
  const auto x = static_cast<std::uint32_t>(c.x + kKeyBiasXZ);
  const auto y = static_cast<std::uint32_t>(c.y + kKeyBiasY);
  const auto z = static_cast<std::uint32_t>(c.z + kKeyBiasXZ);
  if (x >= 2048 || z >= 2048 || y >= 1023) return kNoKey;
  return x | (z << 11) | (y << 22);
}

constexpr BlockCoord coord_of(BlockKey key) {
  return {static_cast<std::int32_t>(key & 2047u) - kKeyBiasXZ,
          static_cast<std::int32_t>(key >> 22) - kKeyBiasY,
          static_cast<std::int32_t>((key >> 11) & 2047u) - kKeyBiasXZ};
}

/// Index of a block in the pool. 16 bits, so that a neighbour table of eight costs 16 bytes a block.
using BlockIndex = std::uint16_t;
inline constexpr BlockIndex kNoBlock = 0xFFFF;
inline constexpr std::size_t kBlocksCapacityMax = 65535;

constexpr int voxel_index(int x, int y, int z) { return x + kBlockSide * (y + kBlockSide * z); }
constexpr int cell_of_voxel(int x, int y, int z) {
  return (x >> 1) + kBlockCellSide * ((y >> 1) + kBlockCellSide * (z >> 1));
}

/// Floor division by 8 and its remainder, for negative values too.
constexpr std::int32_t block_of(std::int32_t voxel) { return voxel >> 3; }
constexpr int in_block(std::int32_t voxel) { return voxel & 7; }

/// Colour of a cell: running mean and its weight, in one word.
struct ColorCell {
  std::uint8_t r = 0, g = 0, b = 0, weight = 0;
};
static_assert(sizeof(ColorCell) == 4);

/// Opaque posterior of a cell, see pipeline/label/label_cell.hpp. 0 = nothing observed.
using LabelWord = std::uint64_t;

}  // namespace tactus::map
