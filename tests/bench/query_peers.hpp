// Two other ways to ask a map, to compare map::Reader with: an octree over the blocks, as the paper has it,
// and marching in even steps. Both read a map that rests, without the reader's sequence counters.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "pipeline/map/map.hpp"
#include "pipeline/map/reader.hpp"

namespace tactus::bench {

/// Blocks as leaves of an octree; a node is 8 indices. Empty nodes are left in one step, whatever their size.
class BlockOctree {
 public:
  explicit BlockOctree(const map::Map& map);

  /// The block at these block coordinates, or kNoBlock and in `side_blocks` the side of the empty node there.
  [[nodiscard]] map::BlockIndex find(const map::BlockCoord& at, int& side_blocks) const;
  [[nodiscard]] std::size_t bytes() const { return nodes_.size() * sizeof(Node); }

 private:
  using Node = std::array<std::int32_t, 8>;  // 0: empty; n > 0: node n; n < 0: block -n - 1
  void insert(const map::BlockCoord& at, map::BlockIndex block);

  // The key's range: 2048 x 1023 x 2048 blocks.
  static constexpr int kLevels = 11, kBias = 1024;
  std::vector<Node> nodes_;
};

struct PeerHit {
  Vec3f position_world_m;
  map::LabelWord label = 0;
};

/// First surface along the ray (unit direction) from its front, by the rules of map::Reader::raycast(): steps
/// of the distance itself inside blocks, and out of empty space by the octree.
bool raycast_octree(const map::Map& map, const BlockOctree& octree, const Vec3f& origin_m,
                    const Vec3f& direction, float range_m_max, PeerHit& hit);

/// The same by looking at a point every half voxel.
bool raycast_march(const map::Map& map, const Vec3f& origin_m, const Vec3f& direction, float range_m_max,
                   PeerHit& hit);

/// As map::Reader::nearest_surface(), by the octree.
bool nearest_octree(const map::Map& map, const BlockOctree& octree, const Vec3f& p_m, PeerHit& hit);

}  // namespace tactus::bench
