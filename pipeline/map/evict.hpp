// Keeping blocks free ahead of need.
//
// Rule: when fewer than `free_min` blocks are free, blocks not seen for `age` frames go, farthest first
// within a scan part; `age` begins at 300 frames (10 s) and halves each time a whole round over the pool has
// not freed enough, down to 2; it recovers when enough is free. Per frame 1/16 of the pool is looked at and
// at most kEvictionsMax blocks go.
#pragma once

#include "pipeline/map/map.hpp"

namespace tactus::map {

class Evictor {
 public:
  static constexpr std::uint32_t kScanParts = 16;
  static constexpr std::uint32_t kEvictionsMax = 256;
  static constexpr std::uint32_t kAgeFramesFirst = 300, kAgeFramesMin = 2;

  /// Writer thread, step, before select_blocks(). Returns the number of blocks evicted.
  std::uint32_t step(Map& map, std::uint32_t frame, const Vec3d& camera_world_m,
                     std::uint32_t free_min) noexcept;

 private:
  std::uint32_t cursor_ = 0;
  std::uint32_t age_frames_ = kAgeFramesFirst;
};

}  // namespace tactus::map
