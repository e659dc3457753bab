#include <algorithm>
#include <cmath>

#include "pipeline/map/integrate.hpp"

namespace tactus::map {
namespace {

constexpr int kPixelStride = 2;  // of the half-resolution image
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
  BlockKey last[3] = {kNoKey, kNoKey, kNoKey};
  for (int y = 0; y < height; y += kPixelStride)
    for (int x = 0; x < width; x += kPixelStride) {
      const float z = frame.half_depth_m[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                                         static_cast<std::size_t>(x)];
      if (!(z > 0)) continue;
      const float a = (static_cast<float>(x) - cx) / fx, b = (static_cast<float>(y) - cy) / fy;
      const Vec3f ray = ex * a + ey * b + ez;  // per metre of depth
      // Three points at most one truncation apart (a ray is at most 1.3 times its depth): no block is jumped
      // over.
      const float depths[3] = {z - config.truncation_m, z, z + config.truncation_m};
      for (int k = 0; k < 3; ++k) {
        const Vec3f p = origin + ray * (depths[k] * to_voxels);
        const BlockCoord c{static_cast<std::int32_t>(std::floor(p.x + 0.5f)) >> 3,
                           static_cast<std::int32_t>(std::floor(p.y + 0.5f)) >> 3,
                           static_cast<std::int32_t>(std::floor(p.z + 0.5f)) >> 3};
        const BlockKey key = key_of(c);
        if (key == last[k]) continue;
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
