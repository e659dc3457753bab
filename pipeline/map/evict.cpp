#include "pipeline/map/evict.hpp"

#include <algorithm>
#include <array>

namespace tactus::map {

std::uint32_t Evictor::step(Map& map, std::uint32_t frame, const Vec3d& camera_world_m,
                            std::uint32_t free_min) noexcept {
  if (map.blocks_free() >= free_min) {
    age_frames_ = kAgeFramesFirst;
    return 0;
  }
  struct Candidate {
    float distance2;
    BlockIndex block;
  };
  std::array<Candidate, kEvictionsMax>
      farthest;  // min-heap on distance: the nearest candidate is the first to be kept
  std::size_t count = 0;
  const auto nearer = [](const Candidate& a, const Candidate& b) {
    return a.distance2 != b.distance2 ? a.distance2 > b.distance2 : a.block > b.block;
  };
  const MapConfig& config = map.config();
  const float block_m = kBlockSide * config.voxel_size_m;
  const Vec3f camera = camera_world_m.cast<float>();
  const std::uint32_t part = (config.blocks_capacity + kScanParts - 1) / kScanParts;
  for (std::uint32_t i = 0; i < part; ++i) {
    const auto block = static_cast<BlockIndex>(cursor_);
    cursor_ = cursor_ + 1 < config.blocks_capacity ? cursor_ + 1 : 0;
    if (cursor_ == 0) age_frames_ = std::max(kAgeFramesMin, age_frames_ / 2);
    const BlockKey key = map.key(block);
    if (key == kNoKey || frame - map.last_seen_frame(block) < age_frames_) continue;
    const BlockCoord c = coord_of(key);
    const Vec3f p =
        Vec3f{static_cast<float>(c.x), static_cast<float>(c.y), static_cast<float>(c.z)} * block_m - camera;
    const Candidate candidate{p.dot(p), block};
    if (count < kEvictionsMax) {
      farthest[count++] = candidate;
      std::push_heap(farthest.begin(), farthest.begin() + static_cast<std::ptrdiff_t>(count), nearer);
    } else if (nearer(candidate, farthest[0])) {
      std::pop_heap(farthest.begin(), farthest.end(), nearer);
      farthest.back() = candidate;
      std::push_heap(farthest.begin(), farthest.end(), nearer);
    }
  }
  const std::uint32_t wanted =
      std::min<std::uint32_t>(static_cast<std::uint32_t>(count), free_min - map.blocks_free());
  std::sort(farthest.begin(), farthest.begin() + static_cast<std::ptrdiff_t>(count), nearer);
  for (std::uint32_t i = 0; i < wanted; ++i) map.evict(farthest[i].block);
  return wanted;
}

}  // namespace tactus::map
