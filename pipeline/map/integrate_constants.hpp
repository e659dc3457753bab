// What the vector kernel and the reference share: per-frame constants of the projection, and the rules'
// numbers.
#pragma once

#include <cstdint>

#include "pipeline/map/integrate.hpp"
#include "pipeline/register/depth_images.hpp"

namespace tactus::map {

struct BlockOrigin;

/// Lattice points of a block in the camera, in kDepthUnitM: x and y scaled by the focal length, so that u = x / z + cx.
/// Distances from the surface are in TSDF steps, as the map stores them.
///
/// 1 / z of a voxel is one Newton step from its cell centre's: off by the square of their difference in z over z, at
/// most (0.87 voxels / z)^2. At 1 cm and 0.4 m that is 0.15 pixels at the image's edge, where a voxel is 15 wide.
struct IntegrationConstants {
  static constexpr float kNear = 0.05f / kDepthUnitM;
  static constexpr std::int32_t kWeightMax = 255;
  static constexpr float kColorWeightMax = 8.0f;  // beyond, rounding to 8 bits would freeze the mean
  static constexpr std::uint32_t kColorEveryFrames = 8;  // colours change slowly and cost a quarter of the voxels

  IntegrationConstants(const Map& map, const IntegrationFrame& frame);

  [[nodiscard]] BlockOrigin origin_of(BlockKey key) const noexcept;
  // A block that has seen this many frames is averaged over dozens already: every second frame changes it by less than
  // its noise, and halves what integration costs. At 30 Hz what moves is still carved within two frames more.
  static constexpr std::uint8_t kSettledUpdates = 24;
  /// False in every second frame for settled blocks, half of them at a time.
  [[nodiscard]] bool voxels_due(const Map& map, BlockIndex block) const noexcept {
    return map.updates_count(block) < kSettledUpdates || (frame_index + block) % 2 == 0;
  }
  /// A new block at once, others in turn.
  [[nodiscard]] bool colors_due(const Map& map, BlockIndex block) const noexcept;

  alignas(64) float offset_x[64], offset_y[64], offset_z[64];  // of voxel (i & 7, i >> 3, 0)
  alignas(64) float cell_offset_x[16], cell_offset_y[16],
      cell_offset_z[16];  // of the centre of cell (i & 3, i >> 2, 0)
  Vec3f step_z;           // one voxel along the block's z
  double r[9], t[3];      // lattice -> scaled camera, depth units
  float cx = 0, cy = 0;
  std::int32_t width = 0, height = 0;  // pixels
  float row_pixels = 0;                // width
  const std::uint32_t* pixels = nullptr;
  const std::uint16_t* tiles = nullptr;
  const std::uint32_t* half_color = nullptr;  // null: no colour
  float cosine_to_steps = 0;  // a tile's cosine byte to TSDF steps per depth unit
  float color_band = 0;       // in TSDF steps
  // How far behind the measured surface voxels are still written, in TSDF steps: two voxels, or as many sigmas of the
  // measurement. Less would cut the noise off on one side and push the surface back; more makes walls behind edges.
  static constexpr float kBehindSigmas = 4.0f;
  float behind_min = 0, sigma_base = 0, sigma_slope = 0;  // of depth_sigma_m(), times kBehindSigmas: steps, steps per unit^2
  std::uint32_t frame_index = 0;

  // Five half-spaces of the scaled camera that hold exactly the points that project at least one pixel inside the image
  // and lie beyond kNear. All voxels of a block are in one when its first voxel is `margin` inside.
  struct HalfSpace {
    float x, y, z, margin;
  };
  HalfSpace inside[5];
};

/// Where a block's first voxel lies in the scaled camera.
struct BlockOrigin {
  Vec3f p;
  /// Whether every voxel and cell projects into the image (no test of each is needed then).
  [[nodiscard]] bool is_inside(const IntegrationConstants& c) const noexcept {
    for (const IntegrationConstants::HalfSpace& h : c.inside)
      if (!(h.x * p.x + h.y * p.y + h.z * p.z > h.margin)) return false;
    return true;
  }
  [[nodiscard]] Vec3f slice(const IntegrationConstants& c, int z) const noexcept {
    return p + c.step_z * static_cast<float>(z);
  }
  [[nodiscard]] Vec3f cell_slice(const IntegrationConstants& c, int z) const noexcept {
    return p + c.step_z * (static_cast<float>(kCellSide * z) + 0.5f);
  }
};

}  // namespace tactus::map
