#include "pipeline/label_view.hpp"

#include <algorithm>
#include <cstddef>

#include "pipeline/register/half_color.hpp"
#include "rt/assert.hpp"

namespace tactus {
namespace {

std::size_t pixels_count(int width, int height) {
  return static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
}

}  // namespace

PictureCamera picture_camera_at(const T_WorldDepth& T_world_depth, const hal::RigCalibration& rig) noexcept {
  if (!rig.has_color || rig.registered) return {rig.depth, T_world_depth};
  const Transform<World, Color> T_world_color = T_world_depth * rig.T_color_depth.inverse();
  return {rig.color, {T_world_color.rotation, T_world_color.translation}};
}

Vec3d ray_of(const PictureCamera& camera, int u, int v) noexcept {
  const hal::Intrinsics& c = camera.intrinsics;
  Normalized n{static_cast<float>((u - c.cx) / c.fx), static_cast<float>((v - c.cy) / c.fy)};
  if (c.has_distortion()) n = undistort(c, n);
  return camera.T_world_camera.rotation * Vec3d{static_cast<double>(n.x), static_cast<double>(n.y), 1};
}

void cast_cells(const map::Reader& reader, const PictureCamera& camera, float range_m_max,
                std::span<map::CellAddress> cells, std::span<float> depth_m) noexcept {
  const int width = camera.intrinsics.width, height = camera.intrinsics.height;
  TACTUS_ASSERT(cells.size() == pixels_count(width, height));
  TACTUS_ASSERT(depth_m.empty() || depth_m.size() == cells.size());
  const Vec3f origin = camera.T_world_camera.translation.cast<float>();
  const Vec3d axis = camera.T_world_camera.rotation * Vec3d{0, 0, 1};
  std::size_t pixel = 0;
  for (int v = 0; v < height; ++v)
    for (int u = 0; u < width; ++u, ++pixel) {
      map::SurfacePoint point;
      const bool is_hit = reader.raycast(origin, ray_of(camera, u, v).cast<float>(), range_m_max, point);
      cells[pixel] =
          is_hit ? map::cell_at(point.position_world_m, reader.voxel_size_m()) : map::CellAddress{};
      if (!depth_m.empty())
        depth_m[pixel] =
            is_hit
                ? static_cast<float>(
                      (point.position_world_m.cast<double>() - camera.T_world_camera.translation).dot(axis))
                : 0.0f;
    }
}

void nearest_cells(const map::Reader& reader, const PictureCamera& camera, std::span<const float> depth_m,
                   std::span<map::CellAddress> cells) noexcept {
  TACTUS_ASSERT(cells.size() == pixels_count(camera.intrinsics.width, camera.intrinsics.height) &&
                depth_m.size() == cells.size());
  std::size_t pixel = 0;
  for (int v = 0; v < camera.intrinsics.height; ++v)
    for (int u = 0; u < camera.intrinsics.width; ++u, ++pixel) {
      cells[pixel] = {};
      if (!(depth_m[pixel] > 0)) continue;
      const Vec3d p =
          camera.T_world_camera.translation + ray_of(camera, u, v) * static_cast<double>(depth_m[pixel]);
      map::SurfacePoint point;
      if (reader.nearest_surface(p.cast<float>(), point))
        cells[pixel] = map::cell_at(point.position_world_m, reader.voxel_size_m());
    }
}

void labels_of_scores(const segment::MaterialScores& scores, int width, int height,
                      std::span<MaterialId> labels) noexcept {
  TACTUS_ASSERT(labels.size() == pixels_count(width, height));
  MaterialDistribution p{};
  std::size_t pixel = 0;
  for (int v = 0; v < height; ++v)
    for (int u = 0; u < width; ++u, ++pixel) {
      scores.sample(static_cast<float>(u), static_cast<float>(v), p);
      labels[pixel] = most_likely(p);
    }
}

}  // namespace tactus
