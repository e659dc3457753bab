#include "pipeline/map/reader.hpp"

#include <algorithm>
#include <cmath>

#include "pipeline/label/label_cell.hpp"
#include "pipeline/map/map.hpp"

namespace tactus::map {
namespace {

// A block is changed once a frame, for a tenth of a microsecond: a second try nearly always succeeds.
constexpr int kReadTries = 4;

// The block a reader looked up last: neighbouring reads fall into it.
struct BlockCache {
  BlockKey key = kNoKey;
  BlockIndex block = kNoBlock;
};

BlockIndex lookup(const Map& map, BlockKey key, BlockCache& cache) {
  if (key == cache.key) return cache.block;
  const BlockIndex block = key == kNoKey ? kNoBlock : map.find_concurrent(key);
  cache = {key, block};
  return block;
}

BlockKey key_of_voxel(int i, int j, int k) { return key_of({block_of(i), block_of(j), block_of(k)}); }

// Eight voxels around lattice point (i, j, k), those of one block from one moment. False: unknown.
bool read_corners(const Map& map, int i, int j, int k, float (&v)[8], BlockCache& cache) {
  unsigned done = 0;
  for (unsigned first = 0; first < 8; ++first) {
    if (done & (1u << first)) continue;
    const auto corner = [&](unsigned c) {
      return Vec3<int>{i + static_cast<int>(c & 1u), j + static_cast<int>(c >> 1 & 1u),
                       k + static_cast<int>(c >> 2)};
    };
    const Vec3<int> at = corner(first);
    const BlockKey key = key_of_voxel(at.x, at.y, at.z);
    const BlockIndex block = lookup(map, key, cache);
    if (block == kNoBlock) return false;
    bool good = false;
    unsigned in_this = 0;
    for (int attempt = 0; attempt < kReadTries && !good; ++attempt) {
      const std::uint32_t begun = map.sequence_begin(block);
      in_this = 0;
      bool known = map.key_concurrent(block) == key;
      for (unsigned c = first; known && c < 8; ++c) {
        const Vec3<int> p = corner(c);
        if (key_of_voxel(p.x, p.y, p.z) != key) continue;
        const std::int16_t raw =
            map.tsdf_concurrent(block, voxel_index(in_block(p.x), in_block(p.y), in_block(p.z)));
        known = raw != kTsdfUnknown;
        v[c] = static_cast<float>(raw);
        in_this |= 1u << c;
      }
      if (!map.sequence_validate(block, begun)) continue;
      if (!known) return false;
      good = true;
    }
    if (!good) return false;
    done |= in_this;
  }
  return true;
}

struct FieldSample {
  float value;     // truncations
  Vec3f gradient;  // truncations per voxel
};

bool read_field(const Map& map, const Vec3f& lattice, FieldSample& out, BlockCache& cache) {
  // Beyond the key's range nothing is mapped; and a float that large has no voxel left in it.
  if (!(std::fabs(lattice.x) < 16384.0f && std::fabs(lattice.y) < 16384.0f &&
        std::fabs(lattice.z) < 16384.0f))
    return false;
  const Vec3f floor{std::floor(lattice.x), std::floor(lattice.y), std::floor(lattice.z)};
  float v[8];
  if (!read_corners(map, static_cast<int>(floor.x), static_cast<int>(floor.y), static_cast<int>(floor.z), v,
                    cache))
    return false;
  const Vec3f t = lattice - floor;
  const auto lerp = [](float a, float b, float s) { return a + (b - a) * s; };
  const float d00 = v[1] - v[0], d10 = v[3] - v[2], d01 = v[5] - v[4], d11 = v[7] - v[6];
  const float c00 = v[0] + d00 * t.x, c10 = v[2] + d10 * t.x, c01 = v[4] + d01 * t.x, c11 = v[6] + d11 * t.x;
  const float e0 = c10 - c00, e1 = c11 - c01;
  const float c0 = c00 + e0 * t.y, c1 = c01 + e1 * t.y;
  constexpr float kScale = 1.0f / kTsdfScale;
  out.value = lerp(c0, c1, t.z) * kScale;
  out.gradient =
      Vec3f{lerp(lerp(d00, d10, t.y), lerp(d01, d11, t.y), t.z), lerp(e0, e1, t.z), c1 - c0} * kScale;
  return true;
}

// What the cell around a point of the surface holds.
void read_cell(const Map& map, const Vec3f& lattice, LabelView view, SurfacePoint& out, BlockCache& cache) {
  const int i = static_cast<int>(std::floor(lattice.x + 0.5f)),
            j = static_cast<int>(std::floor(lattice.y + 0.5f)),
            k = static_cast<int>(std::floor(lattice.z + 0.5f));
  const BlockKey key = key_of_voxel(i, j, k);
  const BlockIndex block = lookup(map, key, cache);
  const int cell = cell_of_voxel(in_block(i), in_block(j), in_block(k));
  LabelWord word = 0;
  label::RefinedWord refined = 0;
  ColorCell color;
  std::uint32_t frame = 0;
  bool good = false;
  for (int attempt = 0; attempt < kReadTries && !good && block != kNoBlock; ++attempt) {
    const std::uint32_t begun = map.sequence_begin(block);
    word = map.label_concurrent(block, cell);
    refined = map.refined_concurrent(block, cell);
    color = map.color_concurrent(block, cell);
    frame = map.label_frame_concurrent(block);
    good = map.key_concurrent(block) == key && map.sequence_validate(block, begun);
  }
  if (!good) word = 0;
  if (!good || view == LabelView::fused) refined = 0;
  out.color = {color.r, color.g, color.b};
  out.label_observations = static_cast<std::uint8_t>(label::observations(word));  // at most 127
  out.is_pinned = label::is_pinned(refined);
  if (refined != 0) {
    out.material = label::refined_best(refined);
    label::refined_decode(refined, out.materials);
  } else {
    out.material = out.label_observations > 0 ? label::best(word) : kUnknownMaterial;
    label::decode(word, out.materials);
  }
  out.label_age_frames = std::max(map.frame_concurrent(), frame) - frame;
}

}  // namespace

float Reader::voxel_size_m() const noexcept { return map_->config().voxel_size_m; }
float Reader::truncation_m() const noexcept { return map_->config().truncation_m; }

bool Reader::distance(const Vec3f& p_world_m, float& distance_m) const noexcept {
  BlockCache cache;
  FieldSample sample;
  if (!read_field(*map_, p_world_m * (1.0f / voxel_size_m()), sample, cache)) return false;
  distance_m = sample.value * truncation_m();
  return true;
}

bool Reader::sample(const Vec3f& p_world_m, DistanceSample& out) const noexcept {
  BlockCache cache;
  FieldSample sample;
  if (!read_field(*map_, p_world_m * (1.0f / voxel_size_m()), sample, cache)) return false;
  out.distance_m = sample.value * truncation_m();
  out.gradient = sample.gradient.normalized();
  return true;
}

bool Reader::raycast(const Vec3f& origin_world_m, const Vec3f& direction_world, float range_m_max,
                     SurfacePoint& out) const noexcept {
  const float to_voxels = 1.0f / voxel_size_m();
  const Vec3f direction = direction_world.normalized();
  if (direction == Vec3f{}) return false;
  const Vec3f origin = origin_world_m * to_voxels;
  const float range = range_m_max * to_voxels, truncation = truncation_m() * to_voxels;
  BlockCache cache;
  float s = 0, s_front = 0, f_front = -1;  // last read in front of a surface, f_front < 0: none
  FieldSample sample{};
  const auto at = [&](float along) { return origin + direction * along; };
  while (s <= range) {
    if (!read_field(*map_, at(s), sample, cache)) {
      f_front = -1;
      // An absent block is left in one step; inside a known one unobserved voxels are passed one by one.
      const Vec3f p = at(s);
      const bool absent =
          lookup(*map_,
                 key_of_voxel(static_cast<int>(std::floor(p.x)), static_cast<int>(std::floor(p.y)),
                              static_cast<int>(std::floor(p.z))),
                 cache) == kNoBlock;
      if (!absent) {
        s += 1.0f;
        continue;
      }
      float exit = 1e9f;
      const float position[3] = {p.x, p.y, p.z}, slope[3] = {direction.x, direction.y, direction.z};
      for (int axis = 0; axis < 3; ++axis) {
        const float block = std::floor(position[axis] / kBlockSide) * kBlockSide;
        if (slope[axis] > 0) exit = std::min(exit, (block + kBlockSide - position[axis]) / slope[axis]);
        if (slope[axis] < 0) exit = std::min(exit, (block - position[axis]) / slope[axis]);
      }
      s += std::max(exit, 0.0f) + 0.01f;
      continue;
    }
    if (sample.value > 0) {
      s_front = s;
      f_front = sample.value;
      s += std::max(0.9f * sample.value * truncation, 0.5f);
      continue;
    }
    if (f_front > 0) break;
    s += 1.0f;  // inside something that was entered from unobserved space: its back face is no hit
  }
  if (!(s <= range) || !(f_front > 0)) return false;
  // Secant steps between the last point in front and the first behind.
  float s_back = s, f_back = sample.value;
  float hit = s_front + (s_back - s_front) * (f_front / (f_front - f_back));
  for (int i = 0; i < 2; ++i) {
    FieldSample again{};
    if (!read_field(*map_, at(hit), again, cache)) break;
    sample = again;
    if (again.value > 0) {
      s_front = hit;
      f_front = again.value;
    } else {
      s_back = hit;
      f_back = again.value;
    }
    if (!(f_front - f_back > 1e-6f)) break;
    hit = s_front + (s_back - s_front) * (f_front / (f_front - f_back));
  }
  out.position_world_m = at(hit) * voxel_size_m();
  out.normal_world = sample.gradient.normalized();
  read_cell(*map_, at(hit), view_, out, cache);
  return true;
}

bool Reader::nearest_surface(const Vec3f& p_world_m, SurfacePoint& out) const noexcept {
  constexpr int kStepsMax = 8;
  constexpr float kFoundVoxels = 0.05f;
  const float truncation = truncation_m() / voxel_size_m();
  Vec3f p = p_world_m * (1.0f / voxel_size_m());
  BlockCache cache;
  for (int step = 0; step < kStepsMax; ++step) {
    FieldSample sample;
    if (!read_field(*map_, p, sample, cache)) return false;
    const float slope2 = sample.gradient.dot(sample.gradient);
    // Saturated: the surface is at least the truncation distance away and the field does not say where.
    if (!(slope2 > 1e-6f)) return false;
    const float distance = sample.value * truncation;
    if (std::fabs(distance) < kFoundVoxels) {
      out.position_world_m = p * voxel_size_m();
      out.normal_world = sample.gradient.normalized();
      read_cell(*map_, p, view_, out, cache);
      return true;
    }
    // Newton's step along the gradient, no longer than the distance itself claims.
    const float length = std::sqrt(slope2);
    const float stride = std::min(std::fabs(sample.value) / length, std::fabs(distance) * 1.5f);
    p = p - sample.gradient * ((sample.value > 0 ? stride : -stride) / length);
  }
  return false;
}

}  // namespace tactus::map
