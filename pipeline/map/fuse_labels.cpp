#include "pipeline/map/fuse_labels.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "pipeline/label/pane_evidence.hpp"
#include "pipeline/map/surface_cells.hpp"
#include "pipeline/register/depth_images.hpp"
#include "pipeline/register/half_color.hpp"
#include "pipeline/register/panes.hpp"
#include "rt/assert.hpp"

namespace tactus::map {
namespace {

constexpr float kAgreeVoxels = 1.5f;
constexpr float kAgreeSigmas = 2.0f;
constexpr float kFacingMin = 0.2f;
constexpr float kNearM = 0.1f;

struct Matrix3f {
  float m[9];
  explicit Matrix3f(const Rotation& r) {
    for (std::size_t i = 0; i < 9; ++i) m[i] = static_cast<float>(r.m[i]);
  }
  Vec3f operator*(const Vec3f& v) const {
    return {m[0] * v.x + m[1] * v.y + m[2] * v.z, m[3] * v.x + m[4] * v.y + m[5] * v.z,
            m[6] * v.x + m[7] * v.y + m[8] * v.z};
  }
};

struct Pinhole {
  float fx, fy, cx, cy;
  explicit Pinhole(const hal::Intrinsics& c)
      : fx(static_cast<float>(c.fx)),
        fy(static_cast<float>(c.fy)),
        cx(static_cast<float>(c.cx)),
        cy(static_cast<float>(c.cy)) {}
};

/// Per-keyframe constants, and the three questions in the order in which they are cheap.
class KeyframeView {
 public:
  explicit KeyframeView(const LabelKeyframe& keyframe, const MapConfig& config)
      : keyframe_(keyframe),
        config_(config),
        color_(keyframe.rig.registered ? keyframe.rig.depth : keyframe.rig.color),
        T_depth_world_(keyframe.T_world_depth.inverse()),
        r_depth_world_(T_depth_world_.rotation),
        r_color_depth_(keyframe.rig.registered ? Rotation{} : keyframe.rig.T_color_depth.rotation),
        t_color_depth_(keyframe.rig.registered ? Vec3f{}
                                               : keyframe.rig.T_color_depth.translation.cast<float>()),
        depth_pinhole_(keyframe.half_camera),
        color_pinhole_(color_),
        is_distorted_(color_.has_distortion()) {}

  [[nodiscard]] Vec3f origin_of(BlockKey key) const {
    const BlockCoord c = coord_of(key);
    const double size = kBlockSide * static_cast<double>(config_.voxel_size_m);
    return (T_depth_world_ * Vec3d{c.x * size, c.y * size, c.z * size}).cast<float>();
  }

  /// Colour pixel at which the keyframe saw this surface, and whether as a pane; false when it did not.
  bool saw(const Vec3f& block_origin_depth, const CellSurface& surface, float& u, float& v, bool& as_pane) const {
    const Vec3f p = block_origin_depth + r_depth_world_ * surface.foot_m;
    if (!(p.z > kNearM)) return false;
    const Vec3f ray{p.x / p.z, p.y / p.z, 1};
    const Vec3f normal = r_depth_world_ * surface.normal_world;
    const float toward = -normal.dot(ray);  // times the ray's length: the cosine
    if (!(toward >= kFacingMin * ray.norm())) return false;
    const float du = ray.x * depth_pinhole_.fx + depth_pinhole_.cx + 0.5f;
    const float dv = ray.y * depth_pinhole_.fy + depth_pinhole_.cy + 0.5f;
    if (!(du >= 0 && dv >= 0 && du < static_cast<float>(keyframe_.half_camera.width) &&
          dv < static_cast<float>(keyframe_.half_camera.height)))
      return false;
    const std::size_t pixel =
        static_cast<std::size_t>(dv) * static_cast<std::size_t>(keyframe_.half_camera.width) +
        static_cast<std::size_t>(du);
    const float measured_m = keyframe_.half_depth_m[pixel];
    if (!(measured_m > 0)) return false;
    const float tolerance_m =
        std::max(kAgreeVoxels * config_.voxel_size_m, kAgreeSigmas * depth_sigma_m(measured_m) * toward);
    if (!(std::fabs(measured_m - p.z) * toward <= tolerance_m)) return false;
    if (!keyframe_.color_pixels.empty() && keyframe_.color_pixels[pixel] == kNoColorPixel) return false;
    as_pane = is_pane(keyframe_.pane_bits, pixel);
    return project_to_color(p, u, v);
  }

  [[nodiscard]] bool may_see(BlockKey key) const {
    const float size = kBlockSide * config_.voxel_size_m;
    const Vec3f half{size / 2, size / 2, size / 2};
    const Vec3f p = origin_of(key) + r_depth_world_ * half;
    const float radius = 0.87f * size;  // half diagonal
    if (p.z < kNearM) return false;
    const float u = depth_pinhole_.fx * p.x / p.z + depth_pinhole_.cx;
    const float v = depth_pinhole_.fy * p.y / p.z + depth_pinhole_.cy;
    // The sphere's silhouette is wider than its radius over z off the axis: by 1 / cos^2, at most 1.6 here.
    const float margin_u = 1.6f * depth_pinhole_.fx * radius / p.z,
                margin_v = 1.6f * depth_pinhole_.fy * radius / p.z;
    return u > -margin_u && v > -margin_v && u < static_cast<float>(keyframe_.half_camera.width) + margin_u &&
           v < static_cast<float>(keyframe_.half_camera.height) + margin_v;
  }

 private:
  bool project_to_color(const Vec3f& p_depth, float& u, float& v) const {
    const Vec3f p = r_color_depth_ * p_depth + t_color_depth_;
    if (!(p.z > kNearM / 2)) return false;
    Normalized n{p.x / p.z, p.y / p.z};
    // Brown's polynomial folds back far outside the image (as in half_color_projected).
    const auto width = static_cast<float>(color_.width), height = static_cast<float>(color_.height);
    if (!(std::fabs(n.x * color_pinhole_.fx) < width && std::fabs(n.y * color_pinhole_.fy) < height))
      return false;
    if (is_distorted_) n = distort(color_, n);
    u = n.x * color_pinhole_.fx + color_pinhole_.cx;
    v = n.y * color_pinhole_.fy + color_pinhole_.cy;
    return u >= -0.5f && v >= -0.5f && u < width - 0.5f && v < height - 0.5f;
  }

  const LabelKeyframe& keyframe_;
  const MapConfig& config_;
  const hal::Intrinsics& color_;
  Transform<Depth, World> T_depth_world_;
  Matrix3f r_depth_world_, r_color_depth_;
  Vec3f t_color_depth_;
  Pinhole depth_pinhole_, color_pinhole_;
  bool is_distorted_;
};

}  // namespace

bool sample_scores(const ScoreView& s, float u, float v,
                   std::span<std::uint8_t, kMaterialCount> out) noexcept {
  const float x = std::clamp(s.scale_u * u + s.offset_u, 0.0f, static_cast<float>(s.width - 1));
  const float y = std::clamp(s.scale_v * v + s.offset_v, 0.0f, static_cast<float>(s.height - 1));
  const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
  const int x1 = std::min(x0 + 1, s.width - 1), y1 = std::min(y0 + 1, s.height - 1);
  const auto fx = static_cast<std::uint32_t>((x - static_cast<float>(x0)) * 256.0f);
  const auto fy = static_cast<std::uint32_t>((y - static_cast<float>(y0)) * 256.0f);
  const auto at = [&](int px, int py) {
    return s.probability +
           (static_cast<std::size_t>(py) * static_cast<std::size_t>(s.width) + static_cast<std::size_t>(px)) *
               kMaterialCount;
  };
  const std::uint8_t *a = at(x0, y0), *b = at(x1, y0), *c = at(x0, y1), *d = at(x1, y1);
  const std::uint32_t wa = (256 - fx) * (256 - fy), wb = fx * (256 - fy), wc = (256 - fx) * fy, wd = fx * fy;
  std::uint32_t any = 0;
  for (std::size_t m = 0; m < kMaterialCount; ++m) {
    const std::uint32_t sum = a[m] * wa + b[m] * wb + c[m] * wc + d[m] * wd;
    out[m] = static_cast<std::uint8_t>((sum + 32768) >> 16);
    any |= out[m];
  }
  return any != 0;
}

FuseLabelsResult fuse_labels(Map& map, const LabelKeyframe& keyframe, std::span<const BlockIndex> blocks,
                             LabelRule rule, std::size_t cells_max) noexcept {
  TACTUS_ASSERT(keyframe.scores.probability != nullptr && keyframe.scores.width > 0 &&
                keyframe.scores.height > 0);
  TACTUS_ASSERT(keyframe.half_depth_m.size() == static_cast<std::size_t>(keyframe.half_camera.width) *
                                                    static_cast<std::size_t>(keyframe.half_camera.height));
  TACTUS_ASSERT(keyframe.color_pixels.empty() ||
                keyframe.color_pixels.size() == keyframe.half_depth_m.size());
  const KeyframeView view(keyframe, map.config());
  FuseLabelsResult result;
  std::array<LabelWord, kBlockCells> labels;
  std::array<std::uint8_t, kMaterialCount> scores;
  for (const BlockIndex block : blocks) {
    if (result.cells_fused >= cells_max) break;
    ++result.blocks_done;
    const BlockKey key = map.key(block);
    if (key == kNoKey) continue;
    const Vec3f origin = view.origin_of(key);
    const std::int16_t* tsdf = map.tsdf(block);
    const auto before = map.labels(block);
    std::size_t fused = 0;
    std::copy(before.begin(), before.end(), labels.begin());
    for (std::uint64_t left = cells_with_surface(tsdf, map.config()); left != 0; left &= left - 1) {
      const int cell = std::countr_zero(left);
      CellSurface surface;
      float u = 0, v = 0;
      bool as_pane = false;
      if (!surface_of_cell(tsdf, cell, map.config(), surface)) continue;
      if (!view.saw(origin, surface, u, v, as_pane) || !sample_scores(keyframe.scores, u, v, scores)) continue;
      LabelWord& word = labels[static_cast<std::size_t>(cell)];
      label::ObservationCosts costs = label::costs_of(scores);
      if (as_pane) label::add_pane_evidence(costs);
      word = rule == LabelRule::bayes ? label::fuse(word, costs) : label::replace(word, costs);
      ++fused;
    }
    if (fused > 0) map.publish_labels(block, labels, keyframe.index);
    result.cells_fused += fused;
  }
  return result;
}

std::size_t blocks_in_keyframe(const Map& map, const LabelKeyframe& keyframe,
                               std::span<BlockIndex> out) noexcept {
  const KeyframeView view(keyframe, map.config());
  std::size_t count = 0;
  for (std::uint32_t block = 0; block < map.config().blocks_capacity && count < out.size(); ++block) {
    const BlockKey key = map.key(static_cast<BlockIndex>(block));
    if (key != kNoKey && view.may_see(key)) out[count++] = static_cast<BlockIndex>(block);
  }
  return count;
}

}  // namespace tactus::map
