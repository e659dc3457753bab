// Maps filled from an exact signed distance, for tests of what reads them.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>

#include "pipeline/map/map.hpp"

namespace tactus::map::test {

/// A map with memory of its own.
class OwnedMap {
 public:
  explicit OwnedMap(const MapConfig& config) : bytes_(rt::round_up(Map::bytes_needed(config), 64)) {
    memory_.reset(static_cast<std::byte*>(std::aligned_alloc(64, bytes_)));
    map.bind(rt::Slice({memory_.get(), bytes_}), config);
  }
  Map map;

 private:
  struct Free {
    void operator()(std::byte* p) const { std::free(p); }
  };
  std::size_t bytes_;
  std::unique_ptr<std::byte, Free> memory_;
};

/// Fills every block within [low, high] (metres) that comes within the truncation of the surface. `distance`
/// is positive in free space; voxels deeper than the truncation, or where `seen` says so, stay unobserved.
/// Colour: grey 100, weight 1.
template <typename Distance, typename Seen>
void fill(Map& map, const Vec3d& low, const Vec3d& high, Distance distance, Seen seen) {
  const auto size = static_cast<double>(map.config().voxel_size_m);
  const auto truncation = static_cast<double>(map.config().truncation_m);
  const auto block_at = [&](double m) { return static_cast<int>(std::floor(m / size / kBlockSide)); };
  BlockStaging staging;
  for (int z = block_at(low.z); z <= block_at(high.z); ++z)
    for (int y = block_at(low.y); y <= block_at(high.y); ++y)
      for (int x = block_at(low.x); x <= block_at(high.x); ++x) {
        bool is_near = false;
        for (int v = 0; v < kBlockVoxels; ++v) {
          const Vec3d p{(x * kBlockSide + (v & 7)) * size, (y * kBlockSide + (v >> 3 & 7)) * size,
                        (z * kBlockSide + (v >> 6)) * size};
          const double d = distance(p);
          is_near = is_near || std::fabs(d) < truncation;
          const bool is_known = d > -truncation && seen(p);
          staging.tsdf[v] =
              is_known
                  ? static_cast<std::int16_t>(std::lround(std::min(d / truncation, 1.0) * double{kTsdfScale}))
                  : kTsdfUnknown;
          staging.weight[v] = is_known ? 10 : 0;
        }
        if (!is_near) continue;
        std::fill_n(staging.color, kBlockCells, ColorCell{100, 100, 100, 1});
        map.publish(map.find_or_allocate(key_of({x, y, z})), staging);
      }
}

template <typename Distance>
void fill(Map& map, const Vec3d& low, const Vec3d& high, Distance distance) {
  fill(map, low, high, distance, [](const Vec3d&) { return true; });
}

/// Live blocks in index order.
template <typename Vector>
void live_blocks(const Map& map, Vector& blocks) {
  blocks.clear();
  for (std::uint32_t b = 0; b < map.config().blocks_capacity; ++b)
    if (map.key(static_cast<BlockIndex>(b)) != kNoKey) blocks.push_back(static_cast<BlockIndex>(b));
}

}  // namespace tactus::map::test
