#include <algorithm>
#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/map/select.cpp"
#include "hwy/foreach_target.h"
// clang-format off
#include "hwy/highway.h"
// clang-format on
#include "pipeline/map/integrate.hpp"
#include "rt/assert.hpp"

#ifndef TACTUS_MAP_RAY_ROW
#define TACTUS_MAP_RAY_ROW  // this file is compiled once per instruction set
namespace tactus::map {

constexpr int kPixelStride = 2;  // of the half-resolution image
constexpr int kPointsPerRay = 3;
constexpr std::size_t kRowKeysMax = 1024;  // images up to 4096 pixels wide
constexpr BlockKey kNoPoint = kNoKey - 1;  // y = 511 as well, so no block has it

/// The rays of one row, in voxels of the world: origin + (base + right * (x - cx) / fx) * depth.
struct RayRow {
  Vec3f origin, base, right;
  float cx, inverse_fx, truncation_m, to_voxels;
};

}  // namespace tactus::map
#endif

HWY_BEFORE_NAMESPACE();
namespace tactus::map::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Keys of the blocks at one truncation before the measured depth, at it, and one behind, for every second pixel.
void RayKeys(const RayRow& row, const float* HWY_RESTRICT depth_m, std::size_t count,
             BlockKey (*HWY_RESTRICT keys)[kRowKeysMax]) {
  const hn::CappedTag<float, 16> df;
  const hn::RebindToSigned<decltype(df)> di;
  const hn::RebindToUnsigned<decltype(df)> du;
  const std::size_t lanes = hn::Lanes(df);
  const auto set = [&](float v) { return hn::Set(df, v); };
  for (std::size_t group = 0; group < count; group += lanes) {
    const auto i = hn::Add(hn::Iota(di, static_cast<std::int32_t>(group)), hn::Zero(di));
    const auto in_row = hn::Lt(i, hn::Set(di, static_cast<std::int32_t>(count)));
    const auto pixel = hn::IfThenElseZero(in_row, hn::Mul(i, hn::Set(di, kPixelStride)));
    const auto z = hn::GatherIndex(df, depth_m, pixel);
    const auto known = hn::And(hn::Gt(z, hn::Zero(df)), hn::RebindMask(df, in_row));
    const auto a = hn::Mul(hn::Sub(hn::ConvertTo(df, pixel), set(row.cx)), set(row.inverse_fx));
    for (int k = 0; k < kPointsPerRay; ++k) {
      const auto depth = hn::Mul(hn::Add(z, set(static_cast<float>(k - 1) * row.truncation_m)), set(row.to_voxels));
      const auto block = [&](float origin, float base, float right, std::int32_t bias) {
        const auto ray = hn::Add(hn::Mul(set(right), a), set(base));
        const auto at = hn::Floor(hn::Add(hn::Add(set(origin), hn::Mul(ray, depth)), set(0.5f)));
        return hn::BitCast(du, hn::Add(hn::ShiftRight<3>(hn::ConvertTo(di, at)), hn::Set(di, bias)));
      };
      const auto x = block(row.origin.x, row.base.x, row.right.x, kKeyBiasXZ);
      const auto y = block(row.origin.y, row.base.y, row.right.y, kKeyBiasY);
      const auto zb = block(row.origin.z, row.base.z, row.right.z, kKeyBiasXZ);
      const auto outside =
          hn::Or(hn::ShiftRight<11>(hn::Or(x, zb)), hn::ShiftRight<10>(hn::Add(y, hn::Set(du, 1))));
      auto key = hn::Or(x, hn::Or(hn::ShiftLeft<11>(zb), hn::ShiftLeft<22>(y)));
      key = hn::IfThenElse(hn::Eq(outside, hn::Zero(du)), key, hn::Set(du, kNoKey));
      key = hn::IfThenElse(hn::RebindMask(du, known), key, hn::Set(du, kNoPoint));
      hn::Store(key, du, keys[k] + group);
    }
  }
}

}  // namespace tactus::map::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tactus::map {
HWY_EXPORT(RayKeys);

namespace {

constexpr std::uint32_t kSweepParts = 16;

struct View {
  Rotation r;  // depth from world
  Vec3d t;
  double fx, fy, cx, cy;
  int width, height;
};

// True when the block may hold voxels in view that are not hidden behind the measured surface.
bool may_be_seen(const View& view, const IntegrationFrame& frame, const MapConfig& config, BlockKey key) {
  const BlockCoord c = coord_of(key);
  const double size = kBlockSide * static_cast<double>(config.voxel_size_m);
  const double half = size / 2 - static_cast<double>(config.voxel_size_m) / 2;  // centre of the voxel centres
  const Vec3d centre{c.x * size + half, c.y * size + half, c.z * size + half};
  const Vec3d p = view.r * centre + view.t;
  const double radius = 0.87 * size;  // half diagonal
  if (p.z < 0.1) return false;
  const double u = view.fx * p.x / p.z + view.cx, v = view.fy * p.y / p.z + view.cy;
  const double margin = view.fx * radius / p.z;
  if (u < -margin || v < -margin || u > view.width - 1 + margin || v > view.height - 1 + margin) return false;
  const int iu = std::clamp(static_cast<int>(u / 2), 0, view.width / 2 - 1);
  const int iv = std::clamp(static_cast<int>(v / 2), 0, view.height / 2 - 1);
  const double measured = static_cast<double>(
      frame.half_depth_m[static_cast<std::size_t>(iv) * static_cast<std::size_t>(view.width / 2) +
                         static_cast<std::size_t>(iu)]);
  return measured > 0 && p.z - radius < measured + static_cast<double>(config.truncation_m);
}

}  // namespace

void select_blocks(Map& map, const IntegrationFrame& frame, ActiveSet& active) noexcept {
  const MapConfig& config = map.config();
  std::swap(active.current_, active.previous_);
  active.previous_count_ = active.count_;
  active.count_ = 0;
  const auto add = [&](BlockIndex block) {
    map.set_last_seen_frame(block, frame.index);
    active.current_[active.count_++] = block;
  };

  const int width = frame.camera.width / 2, height = frame.camera.height / 2;
  const auto fx = static_cast<float>(frame.camera.fx / 2), fy = static_cast<float>(frame.camera.fy / 2);
  const auto cx = static_cast<float>((frame.camera.cx - 0.5) / 2),
             cy = static_cast<float>((frame.camera.cy - 0.5) / 2);
  const float to_voxels = 1.0f / config.voxel_size_m;
  const auto& r = frame.T_world_depth.rotation;
  const Vec3f origin = frame.T_world_depth.translation.cast<float>() * to_voxels;
  const Vec3f ex{static_cast<float>(r(0, 0)), static_cast<float>(r(1, 0)), static_cast<float>(r(2, 0))};
  const Vec3f ey{static_cast<float>(r(0, 1)), static_cast<float>(r(1, 1)), static_cast<float>(r(2, 1))};
  const Vec3f ez{static_cast<float>(r(0, 2)), static_cast<float>(r(1, 2)), static_cast<float>(r(2, 2))};
  RayRow rays{origin, {}, ex, cx, 1.0f / fx, config.truncation_m, to_voxels};
  alignas(64) BlockKey keys[kPointsPerRay][kRowKeysMax];
  const auto count = static_cast<std::size_t>((width + kPixelStride - 1) / kPixelStride);
  TACTUS_ASSERT(count + 16 <= kRowKeysMax);
  BlockKey last[kPointsPerRay] = {kNoKey, kNoKey, kNoKey};
  for (int y = 0; y < height; y += kPixelStride) {
    rays.base = ey * ((static_cast<float>(y) - cy) / fy) + ez;
    const std::size_t row = static_cast<std::size_t>(y) * static_cast<std::size_t>(width);
    HWY_DYNAMIC_DISPATCH(RayKeys)(rays, &frame.half_depth_m[row], count, keys);
    for (std::size_t x = 0; x < count; ++x)
      for (int k = 0; k < kPointsPerRay; ++k) {
        const BlockKey key = keys[k][x];
        if (key == last[k] || key == kNoPoint) continue;
        last[k] = key;
        const BlockIndex block = map.find_or_allocate(key);
        if (block != kNoBlock && map.last_seen_frame(block) != frame.index) add(block);
      }
  }
  active.surface_count_ = active.count_;

  const auto T_depth_world = frame.T_world_depth.inverse();
  const View view{T_depth_world.rotation, T_depth_world.translation, frame.camera.fx,    frame.camera.fy,
                  frame.camera.cx,        frame.camera.cy,           frame.camera.width, frame.camera.height};
  const auto consider = [&](BlockIndex block) {
    const BlockKey key = map.key(block);
    if (key == kNoKey || map.last_seen_frame(block) == frame.index) return;
    if (may_be_seen(view, frame, config, key)) add(block);
  };
  for (std::size_t i = 0; i < active.previous_count_; ++i) consider(active.previous_[i]);
  const std::uint32_t part = (config.blocks_capacity + kSweepParts - 1) / kSweepParts;
  for (std::uint32_t i = 0; i < part; ++i) {
    consider(static_cast<BlockIndex>(active.sweep_));
    active.sweep_ = active.sweep_ + 1 < config.blocks_capacity ? active.sweep_ + 1 : 0;
  }
}

}  // namespace tactus::map
#endif
