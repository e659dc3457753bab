#include "tests/bench/query_peers.hpp"

#include <algorithm>
#include <cmath>

namespace tactus::bench {
namespace {

using map::BlockCoord;
using map::BlockIndex;
using map::kBlockSide;
using map::kNoBlock;
using map::Map;

struct Field {
  float value = 0;  // truncations
  Vec3f gradient;   // truncations per voxel
};

BlockCoord block_at(const Vec3<int>& v) {
  return {map::block_of(v.x), map::block_of(v.y), map::block_of(v.z)};
}

Vec3<int> floor_of(const Vec3f& p) {
  return {static_cast<int>(std::floor(p.x)), static_cast<int>(std::floor(p.y)),
          static_cast<int>(std::floor(p.z))};
}

/// The field at a point, trilinear; find(block coordinates) answers the block. False: unknown.
template <typename Find>
bool sample(const Map& map, const Find& find, const Vec3f& lattice, Field& out) {
  const Vec3<int> base = floor_of(lattice);
  float v[8];
  BlockCoord known_at{1 << 20, 0, 0};
  BlockIndex known = kNoBlock;
  for (int c = 0; c < 8; ++c) {
    const Vec3<int> at{base.x + (c & 1), base.y + (c >> 1 & 1), base.z + (c >> 2)};
    const BlockCoord block = block_at(at);
    if (!(block == known_at)) {
      known_at = block;
      known = find(block);
    }
    if (known == kNoBlock) return false;
    const std::int16_t raw =
        map.tsdf(known)[map::voxel_index(map::in_block(at.x), map::in_block(at.y), map::in_block(at.z))];
    if (raw == map::kTsdfUnknown) return false;
    v[c] = static_cast<float>(raw) / map::kTsdfScale;
  }
  const Vec3f t =
      lattice - Vec3f{static_cast<float>(base.x), static_cast<float>(base.y), static_cast<float>(base.z)};
  const auto mix = [](float a, float b, float s) { return a + (b - a) * s; };
  const float x00 = mix(v[0], v[1], t.x), x10 = mix(v[2], v[3], t.x), x01 = mix(v[4], v[5], t.x),
              x11 = mix(v[6], v[7], t.x);
  out.value = mix(mix(x00, x10, t.y), mix(x01, x11, t.y), t.z);
  out.gradient = {mix(mix(v[1] - v[0], v[3] - v[2], t.y), mix(v[5] - v[4], v[7] - v[6], t.y), t.z),
                  mix(x10 - x00, x11 - x01, t.z), mix(x01, x11, t.y) - mix(x00, x10, t.y)};
  return true;
}

template <typename Find>
void answer(const Map& map, const Find& find, const Vec3f& lattice, PeerHit& hit) {
  hit.position_world_m = lattice * map.config().voxel_size_m;
  const Vec3<int> v = floor_of(lattice + Vec3f{0.5F, 0.5F, 0.5F});
  const BlockIndex block = find(block_at(v));
  hit.label = block == kNoBlock ? 0
                                : map.labels(block)[static_cast<std::size_t>(map::cell_of_voxel(
                                      map::in_block(v.x), map::in_block(v.y), map::in_block(v.z)))];
}

/// Way out of the cube of `side` voxels around p, in voxels.
float exit_of(const Vec3f& p, const Vec3f& direction, float side) {
  float exit = 1e9F;
  const float position[3] = {p.x, p.y, p.z}, slope[3] = {direction.x, direction.y, direction.z};
  for (int axis = 0; axis < 3; ++axis) {
    const float low = std::floor(position[axis] / side) * side;
    if (slope[axis] > 0) exit = std::min(exit, (low + side - position[axis]) / slope[axis]);
    if (slope[axis] < 0) exit = std::min(exit, (low - position[axis]) / slope[axis]);
  }
  return std::max(exit, 0.0F) + 0.01F;
}

/// Both ways along a ray: `in_empty` says how far to go where no block is, `in_front` where the field is
/// positive.
template <typename Find, typename InEmpty, typename InFront>
bool cast(const Map& map, const Find& find, const InEmpty& in_empty, const InFront& in_front,
          const Vec3f& origin_m, const Vec3f& direction, float range_m_max, PeerHit& hit) {
  const float to_voxels = 1 / map.config().voxel_size_m, range = range_m_max * to_voxels;
  const Vec3f origin = origin_m * to_voxels;
  float s = 0, s_front = 0, f_front = -1;
  while (s <= range) {
    const Vec3f p = origin + direction * s;
    Field field;
    if (!sample(map, find, p, field)) {
      f_front = -1;
      s += in_empty(p);
      continue;
    }
    if (field.value > 0) {
      s_front = s;
      f_front = field.value;
      s += in_front(field.value);
      continue;
    }
    if (f_front <= 0) {
      s += 1;
      continue;
    }
    float s_back = s, f_back = field.value;
    float at = s_front + (s_back - s_front) * f_front / (f_front - f_back);
    for (int i = 0; i < 2 && sample(map, find, origin + direction * at, field); ++i) {
      if (field.value > 0) {
        s_front = at;
        f_front = field.value;
      } else {
        s_back = at;
        f_back = field.value;
      }
      if (!(f_front - f_back > 1e-6F)) break;
      at = s_front + (s_back - s_front) * f_front / (f_front - f_back);
    }
    answer(map, find, origin + direction * at, hit);
    return true;
  }
  return false;
}

}  // namespace

BlockOctree::BlockOctree(const Map& map) : nodes_(1) {
  for (std::uint32_t b = 0; b < map.config().blocks_capacity; ++b)
    if (const auto block = static_cast<BlockIndex>(b); map.key(block) != map::kNoKey)
      insert(map::coord_of(map.key(block)), block);
}

void BlockOctree::insert(const BlockCoord& at, BlockIndex block) {
  std::size_t node = 0;
  for (int level = kLevels - 1;; --level) {
    const auto bit = [&](int v) { return static_cast<std::size_t>((v + kBias) >> level & 1); };
    const std::size_t child = bit(at.x) | bit(at.y) << 1 | bit(at.z) << 2;
    if (level == 0) {
      nodes_[node][child] = -static_cast<std::int32_t>(block) - 1;
      return;
    }
    if (nodes_[node][child] == 0) {
      nodes_[node][child] = static_cast<std::int32_t>(nodes_.size());
      nodes_.push_back({});
    }
    node = static_cast<std::size_t>(nodes_[node][child]);
  }
}

BlockIndex BlockOctree::find(const BlockCoord& at, int& side_blocks) const {
  std::int32_t node = 0;
  for (int level = kLevels - 1; level >= 0; --level) {
    const auto bit = [&](int v) { return static_cast<std::size_t>((v + kBias) >> level & 1); };
    node = nodes_[static_cast<std::size_t>(node)][bit(at.x) | bit(at.y) << 1 | bit(at.z) << 2];
    side_blocks = 1 << level;
    if (node <= 0) break;
  }
  return node < 0 ? static_cast<BlockIndex>(-node - 1) : kNoBlock;
}

bool raycast_octree(const Map& map, const BlockOctree& octree, const Vec3f& origin_m, const Vec3f& direction,
                    float range_m_max, PeerHit& hit) {
  int side_blocks = 1;
  const float truncation = map.config().truncation_m / map.config().voxel_size_m;
  return cast(
      map, [&](const BlockCoord& at) { return octree.find(at, side_blocks); },
      [&](const Vec3f& p) {
        if (octree.find(block_at(floor_of(p)), side_blocks) != kNoBlock) return 1.0F;
        return exit_of(p, direction, static_cast<float>(side_blocks * kBlockSide));
      },
      [&](float value) { return std::max(0.9F * value * truncation, 0.5F); }, origin_m, direction,
      range_m_max, hit);
}

bool raycast_march(const Map& map, const Vec3f& origin_m, const Vec3f& direction, float range_m_max,
                   PeerHit& hit) {
  return cast(
      map, [&](const BlockCoord& at) { return map.find(map::key_of(at)); }, [](const Vec3f&) { return 0.5F; },
      [](float) { return 0.5F; }, origin_m, direction, range_m_max, hit);
}

bool nearest_octree(const Map& map, const BlockOctree& octree, const Vec3f& p_m, PeerHit& hit) {
  int side_blocks = 1;
  const auto find = [&](const BlockCoord& at) { return octree.find(at, side_blocks); };
  const float truncation = map.config().truncation_m / map.config().voxel_size_m;
  Vec3f p = p_m * (1 / map.config().voxel_size_m);
  for (int step = 0; step < 8; ++step) {
    Field field;
    if (!sample(map, find, p, field)) return false;
    const float slope = field.gradient.norm(), distance = field.value * truncation;
    if (!(slope > 1e-3F)) return false;
    if (std::fabs(distance) < 0.05F) {
      answer(map, find, p, hit);
      return true;
    }
    const float stride = std::min(std::fabs(field.value) / slope, std::fabs(distance) * 1.5F);
    p = p - field.gradient * ((field.value > 0 ? stride : -stride) / slope);
  }
  return false;
}

}  // namespace tactus::bench
