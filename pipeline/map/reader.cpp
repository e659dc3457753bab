#include "pipeline/map/reader.hpp"

#include <algorithm>
#include <cmath>

#include "pipeline/label/label_cell.hpp"
#include "pipeline/map/map.hpp"

namespace tactus::map {
namespace {

// A block is changed once a frame, for a tenth of a microsecond: a second try nearly always succeeds.
constexpr int kReadTries = 4;

// A ray looks at single voxels while these are farther from a surface than this; at the eight around a point
// nearer by. The nearest voxel's centre is up to kNearestVoxels away.
constexpr float kFarVoxels = 2.0f, kNearestVoxels = 0.87f;

// The blocks that a reader looked up last, one of each parity along the axes: the up to eight blocks around a
// point are of different parities, so none takes another's place.
class BlockCache {
 public:
  explicit BlockCache(const Map& map) : map_(map) {}
  BlockIndex find(const BlockCoord& at) {
    const BlockKey key = key_of(at);
    Entry& entry = entries_[(at.x & 1) | (at.y & 1) << 1 | (at.z & 1) << 2];
    if (entry.key != key) entry = {key, map_.find_concurrent(key)};
    return entry.block;
  }

 private:
  struct Entry {
    BlockKey key = kNoKey;  // and kNoBlock: nothing is mapped beyond the key's range
    BlockIndex block = kNoBlock;
  };
  const Map& map_;
  Entry entries_[8];
};

// Reads of one block from one moment: false when the writer changed it at every try or another took its
// place.
template <typename Read>
bool read_block(const Map& map, BlockIndex block, BlockKey key, const Read& read) {
  for (int attempt = 0; attempt < kReadTries; ++attempt) {
    const std::uint32_t begun = map.sequence_begin(block);
    const bool is_it = map.key_concurrent(block) == key;
    if (is_it) read();
    if (map.sequence_validate(block, begun)) return is_it;
  }
  return false;
}

// Eight voxels around lattice point `at`, those of one block from one moment. False: unknown.
bool read_corners(const Map& map, const Vec3<int>& at, std::int16_t (&v)[8], BlockCache& cache) {
  const BlockCoord c{block_of(at.x), block_of(at.y), block_of(at.z)};
  const int x = in_block(at.x), y = in_block(at.y), z = in_block(at.z);
  constexpr int kLast = kBlockSide - 1;
  // A bit for each axis along which the corners lie in two blocks: none for two points of three.
  const unsigned across = (x == kLast ? 1u : 0u) | (y == kLast ? 2u : 0u) | (z == kLast ? 4u : 0u);
  if (across == 0) {
    const BlockIndex block = cache.find(c);
    if (block == kNoBlock) return false;
    const int first = voxel_index(x, y, z);
    const bool is_read = read_block(map, block, key_of(c), [&] {
      for (int row = 0; row < 4; ++row) {
        const int voxel = first + (row & 1) * kBlockSide + (row >> 1) * kBlockSide * kBlockSide;
        v[2 * row] = map.tsdf_concurrent(block, voxel);
        v[2 * row + 1] = map.tsdf_concurrent(block, voxel + 1);
      }
    });
    if (!is_read) return false;
  } else {
    BlockIndex block[8];
    for (unsigned side = across;; side = (side - 1) & across) {  // the subsets of `across`
      block[side] = cache.find({c.x + static_cast<int>(side & 1u), c.y + static_cast<int>(side >> 1 & 1u),
                                c.z + static_cast<int>(side >> 2)});
      if (block[side] == kNoBlock) return false;
      if (side == 0) break;
    }
    const int column[2] = {x, (x + 1) & kLast}, line[2] = {y, (y + 1) & kLast},
              slice[2] = {z, (z + 1) & kLast};
    for (unsigned side = across;; side = (side - 1) & across) {
      const BlockCoord at_side{c.x + static_cast<int>(side & 1u), c.y + static_cast<int>(side >> 1 & 1u),
                               c.z + static_cast<int>(side >> 2)};
      const bool is_read = read_block(map, block[side], key_of(at_side), [&] {
        const unsigned within = ~across & 7u;
        for (unsigned more = within;; more = (more - 1) & within) {
          const unsigned corner = side | more;
          v[corner] = map.tsdf_concurrent(
              block[side], voxel_index(column[corner & 1u], line[corner >> 1 & 1u], slice[corner >> 2]));
          if (more == 0) break;
        }
      });
      if (!is_read) return false;
      if (side == 0) break;
    }
  }
  bool is_known = true;
  for (const std::int16_t raw : v) is_known = is_known && raw != kTsdfUnknown;
  return is_known;
}

// Beyond the key's range nothing is mapped; and a float that large has no voxel left in it.
bool is_in_extent(const Vec3f& lattice) {
  return std::fabs(lattice.x) < 16384.0f && std::fabs(lattice.y) < 16384.0f &&
         std::fabs(lattice.z) < 16384.0f;
}

// Without a call into libm, which baseline x86-64 would make. Within the extent only.
inline int floor_of(float v) {
  const int truncated = static_cast<int>(v);
  return truncated - (static_cast<float>(truncated) > v ? 1 : 0);
}
inline Vec3<int> floor_of(const Vec3f& p) { return {floor_of(p.x), floor_of(p.y), floor_of(p.z)}; }
inline Vec3<int> nearest_voxel(const Vec3f& p) { return floor_of(p + Vec3f{0.5f, 0.5f, 0.5f}); }

struct FieldSample {
  float value;     // truncations
  Vec3f gradient;  // truncations per voxel
};

bool read_field(const Map& map, const Vec3f& lattice, FieldSample& out, BlockCache& cache) {
  if (!is_in_extent(lattice)) return false;
  const Vec3<int> base = floor_of(lattice);
  std::int16_t raw[8];
  if (!read_corners(map, base, raw, cache)) return false;
  float v[8];
  for (int c = 0; c < 8; ++c) v[c] = static_cast<float>(raw[c]);
  const Vec3f t =
      lattice - Vec3f{static_cast<float>(base.x), static_cast<float>(base.y), static_cast<float>(base.z)};
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
  const Vec3<int> at = nearest_voxel(lattice);
  const BlockCoord c{block_of(at.x), block_of(at.y), block_of(at.z)};
  const BlockIndex block = cache.find(c);
  const int cell = cell_of_voxel(in_block(at.x), in_block(at.y), in_block(at.z));
  LabelWord word = 0;
  label::RefinedWord refined = 0;
  ColorCell color;
  std::uint32_t frame = 0;
  const bool good = block != kNoBlock && read_block(map, block, key_of(c), [&] {
                      word = map.label_concurrent(block, cell);
                      refined = map.refined_concurrent(block, cell);
                      color = map.color_concurrent(block, cell);
                      frame = map.label_frame_concurrent(block);
                    });
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
  BlockCache cache(*map_);
  FieldSample sample;
  if (!read_field(*map_, p_world_m * (1.0f / voxel_size_m()), sample, cache)) return false;
  distance_m = sample.value * truncation_m();
  return true;
}

void Reader::distances(std::span<const Vec3f> points_world_m, std::span<float> distances_m) const noexcept {
  BlockCache cache(*map_);
  const float to_voxels = 1.0f / voxel_size_m(), truncation = truncation_m();
  for (std::size_t i = 0; i < points_world_m.size(); ++i) {
    FieldSample sample;
    const bool known = read_field(*map_, points_world_m[i] * to_voxels, sample, cache);
    distances_m[i] = known ? sample.value * truncation : kUnknownDistanceM;
  }
}

bool Reader::sample(const Vec3f& p_world_m, DistanceSample& out) const noexcept {
  BlockCache cache(*map_);
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
  BlockCache cache(*map_);
  float s = 0, s_front = 0, f_front = -1;  // last read in front of a surface, f_front < 0: none
  FieldSample sample{};
  const auto at = [&](float along) { return origin + direction * along; };
  const Vec3f inverse{1 / direction.x, 1 / direction.y, 1 / direction.z};  // may be infinite
  while (s <= range) {
    const Vec3f p = at(s);
    if (!is_in_extent(p)) {
      f_front = -1;
      s += kBlockSide;
      continue;
    }
    // The nearest voxel first: it is one of the eight, and far from a surface it says enough.
    const Vec3<int> voxel = nearest_voxel(p);
    const BlockCoord c{block_of(voxel.x), block_of(voxel.y), block_of(voxel.z)};
    const BlockIndex block = cache.find(c);
    if (block == kNoBlock) {  // left in one step, and empty cubes of blocks likewise
      f_front = -1;
      const int blocks = map_->may_hold_cube(c) ? 1 : Occupancy::kCubeSideBlocks;
      const auto exit_along = [blocks](float from, float slope_inverse, std::int32_t block_coord) {
        const float low = static_cast<float>((block_coord & -blocks) * kBlockSide) - 0.5f;
        const float side = static_cast<float>(blocks * kBlockSide);
        return ((slope_inverse > 0 ? low + side : low) - from) * slope_inverse;
      };
      float exit = 1e9f;
      if (direction.x != 0) exit = std::min(exit, exit_along(p.x, inverse.x, c.x));
      if (direction.y != 0) exit = std::min(exit, exit_along(p.y, inverse.y, c.y));
      if (direction.z != 0) exit = std::min(exit, exit_along(p.z, inverse.z, c.z));
      s += std::max(exit, 0.0f) + 0.01f;
      continue;
    }
    std::int16_t raw = kTsdfUnknown;
    const int index = voxel_index(in_block(voxel.x), in_block(voxel.y), in_block(voxel.z));
    if (!read_block(*map_, block, key_of(c), [&] { raw = map_->tsdf_concurrent(block, index); }))
      raw = kTsdfUnknown;
    const float near = static_cast<float>(raw) * (1 / kTsdfScale);
    if (raw != kTsdfUnknown && near * truncation > kFarVoxels) {
      s_front = s;
      f_front = near;
      s += 0.9f * (near * truncation - kNearestVoxels);
      continue;
    }
    if (raw == kTsdfUnknown || !read_field(*map_, p, sample, cache)) {
      f_front = -1;
      s += 1.0f;  // unobserved voxels inside a known block are passed one by one
      continue;
    }
    if (sample.value > 0) {
      s_front = s;
      f_front = sample.value;
      s += std::max(0.9f * sample.value * truncation, 0.5f);
      continue;
    }
    if (f_front > 0) {
      map_->prefetch_cell(block, cell_of_voxel(in_block(voxel.x), in_block(voxel.y), in_block(voxel.z)));
      break;
    }
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
  BlockCache cache(*map_);
  // The point is off the surface by a cell or two at most: most often the same lines of the cache.
  if (is_in_extent(p)) {
    const Vec3<int> voxel = nearest_voxel(p);
    const BlockIndex block = cache.find({block_of(voxel.x), block_of(voxel.y), block_of(voxel.z)});
    if (block != kNoBlock)
      map_->prefetch_cell(block, cell_of_voxel(in_block(voxel.x), in_block(voxel.y), in_block(voxel.z)));
  }
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
