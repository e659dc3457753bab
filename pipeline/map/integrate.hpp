// Fusing one depth frame into the map (Curless & Levoy 1996; KinectFusion, Newcombe et al. 2011, sec. 3.3).
//
// Two halves: select_blocks() finds the blocks that the frame can change (and makes the new ones), in an
// order fixed by the frame; integrate_blocks() updates any part of that list and may run for disjoint parts
// on several threads.
#pragma once

#include <cstdint>
#include <span>

#include "hal/calibration.hpp"
#include "hal/transform.hpp"
#include "pipeline/map/map.hpp"
#include "pipeline/register/depth_images.hpp"

namespace tactus::map {

/// A frame as integration sees it.
struct IntegrationFrame {
  hal::Intrinsics camera;                     // full resolution, no distortion
  IntegrationImage image;                     // pipeline/register/depth_images.hpp
  std::span<const float> half_depth_m;        // half resolution
  std::span<const std::uint32_t> half_color;  // half resolution R, G, B, valid (255 or 0); empty: no colour
  T_WorldDepth T_world_depth;
  std::uint32_t index = 0;  // frame counter, from 1
};

/// The blocks a frame touches, in fixed memory. `blocks` holds blocks around the measured surface first, then
/// those in view in front of it (free space to carve).
class ActiveSet {
 public:
  static std::size_t bytes_needed(std::uint32_t blocks_capacity) {
    return 2 * rt::bytes_of<BlockIndex>(blocks_capacity);
  }
  void bind(rt::Slice& memory, std::uint32_t blocks_capacity) {
    current_ = memory.take<BlockIndex>(blocks_capacity);
    previous_ = memory.take<BlockIndex>(blocks_capacity);
  }
  [[nodiscard]] std::span<const BlockIndex> blocks() const noexcept { return current_.first(count_); }
  [[nodiscard]] std::size_t surface_count() const noexcept { return surface_count_; }

 private:
  friend void select_blocks(Map&, const IntegrationFrame&, ActiveSet&) noexcept;
  std::span<BlockIndex> current_, previous_;
  std::size_t count_ = 0, previous_count_ = 0, surface_count_ = 0;
  std::uint32_t sweep_ = 0;  // where the rolling search for blocks that came into view goes on
};

/// Writer thread. Allocates blocks within the truncation distance of the measured surface along each ray
/// (every fourth pixel: 23 mm apart at 3 m, a block is 80 mm), keeps last frame's blocks that are still in
/// view and not hidden, and looks through 1/16 of the pool for blocks that came into view. Bounded by the
/// pool's size.
void select_blocks(Map& map, const IntegrationFrame& frame, ActiveSet& active) noexcept;

/// Updates distance, weight and colour of the given blocks. Writer thread, or its fork-join helpers on
/// disjoint parts. Vectorised; equals integrate_blocks_reference() bit for bit.
void integrate_blocks(Map& map, const IntegrationFrame& frame, std::span<const BlockIndex> blocks) noexcept;

/// The same, one voxel at a time: the oracle of the tests.
void integrate_blocks_reference(Map& map, const IntegrationFrame& frame,
                                std::span<const BlockIndex> blocks) noexcept;

}  // namespace tactus::map
