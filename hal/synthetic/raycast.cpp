#include "hal/synthetic/raycast.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "hal/synthetic/raycast_kernel.hpp"
#include "rt/assert.hpp"

namespace tactus::hal::synthetic {
namespace {

static_assert(TileRays::kCount == kTilePixels);

constexpr double kNear_m = 0.05;  // for bounds only; hits nearer than this do not happen on the trajectories

/// Inverts the Brown distortion by fixed-point iteration; at the coefficients used here 30 rounds leave <
/// 1e-12.
void undistort(const Intrinsics& k, double& x, double& y) {
  const double xd = x, yd = y;
  for (int round = 0; round < 30; ++round) {
    const double r2 = x * x + y * y;
    const double radial = 1 + r2 * (k.k1 + r2 * (k.k2 + r2 * k.k3));
    const double dx = 2 * k.p1 * x * y + k.p2 * (r2 + 2 * x * x);
    const double dy = k.p1 * (r2 + 2 * y * y) + 2 * k.p2 * x * y;
    x = (xd - dx) / radial;
    y = (yd - dy) / radial;
  }
}

}  // namespace

PixelRays::PixelRays(const Intrinsics& k)
    : width_(k.width), height_(k.height), focal_px_(k.fx), has_table_(k.has_distortion()) {
  const auto normalized_x = [&](int column) { return (column - k.cx) / k.fx; };
  const auto normalized_y = [&](int row) { return (row - k.cy) / k.fy; };
  if (!has_table_) {
    for (int column = 0; column < width_; ++column) x_.push_back(normalized_x(column));
    for (int row = 0; row < height_; ++row) y_.push_back(normalized_y(row));
    return;
  }
  for (int row = 0; row < height_; ++row)
    for (int column = 0; column < width_; ++column) {
      double x = normalized_x(column), y = normalized_y(row);
      undistort(k, x, y);
      x_.push_back(x);
      y_.push_back(y);
    }
}

void PixelRays::copy_row(int row, std::span<float> x, std::span<float> y) const {
  for (int column = 0; column < width_; ++column) {
    x[at(column)] = static_cast<float>(this->x(column, row));
    y[at(column)] = static_cast<float>(this->y(column, row));
  }
}

Raycaster::Raycaster(const Scene& scene, const Intrinsics& intrinsics) : scene_(&scene), rays_(intrinsics) {
  TACTUS_ASSERT(scene.primitives().size() < kNoPrimitive);
  seen_.reserve(scene.primitives().size());
}

bool Raycaster::find_bounds(const Primitive& primitive, const T_WorldDepth& T_world_camera,
                            Seen& seen) const {
  const Rotation R_camera_local = T_world_camera.rotation.transposed() * primitive.R_local_world.transposed();
  const Vec3d center =
      T_world_camera.rotation.transposed() * (primitive.center_world_m - T_world_camera.translation);
  const Vec3d h = primitive.half_extents_m;
  std::array<Vec3d, 8> corners;
  seen = {1e30, 1e30, -1e30, 1e30, -1e30, 0};
  const auto include = [&](const Vec3d& p) {
    const double x = p.x / p.z, y = p.y / p.z;
    seen.x_min = std::min(seen.x_min, x);
    seen.x_max = std::max(seen.x_max, x);
    seen.y_min = std::min(seen.y_min, y);
    seen.y_max = std::max(seen.y_max, y);
  };
  for (std::size_t i = 0; i < 8; ++i) {
    const Vec3d corner{i & 1U ? h.x : -h.x, i & 2U ? h.y : -h.y, i & 4U ? h.z : -h.z};
    corners[i] = center + R_camera_local * corner;
    seen.z_min_m = std::min(seen.z_min_m, corners[i].z);
    if (corners[i].z >= kNear_m) include(corners[i]);
  }
  for (std::size_t i = 0; i < 8; ++i)
    for (std::size_t bit = 1; bit < 8; bit *= 2) {
      const std::size_t j = i | bit;
      if (j == i || (corners[i].z < kNear_m) == (corners[j].z < kNear_m)) continue;
      const double share = (kNear_m - corners[i].z) / (corners[j].z - corners[i].z);
      include(corners[i] + (corners[j] - corners[i]) * share);
    }
  return seen.x_min <= seen.x_max;
}

void Raycaster::cast(const T_WorldDepth& T_world_camera, Hits& hits) {
  const int width = rays_.width(), height = rays_.height();
  TACTUS_ASSERT(hits.pixels_count() == static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  const auto primitives = scene_->primitives();
  seen_.clear();
  for (std::size_t i = 0; i < primitives.size(); ++i) {
    Seen seen;
    if (!find_bounds(primitives[i], T_world_camera, seen)) continue;
    seen.primitive = static_cast<std::uint16_t>(i);
    seen_.push_back(seen);
  }
  std::sort(seen_.begin(), seen_.end(), [](const Seen& a, const Seen& b) {
    return a.z_min_m != b.z_min_m ? a.z_min_m < b.z_min_m : a.primitive < b.primitive;
  });

  TileRays tile;
  for (int row0 = 0; row0 < height; row0 += kTileSide)
    for (int column0 = 0; column0 < width; column0 += kTileSide) {
      double x_min = 1e30, x_max = -1e30, y_min = 1e30, y_max = -1e30;
      for (int i = 0; i < kTilePixels; ++i) {
        // Tiles that stick out repeat the last row and column.
        const int row = std::min(row0 + i / kTileSide, height - 1);
        const int column = std::min(column0 + i % kTileSide, width - 1);
        const double x = rays_.x(column, row), y = rays_.y(column, row);
        tile.x[i] = x;
        tile.y[i] = y;
        tile.t_m[i] = 1e6;
        tile.solid[i] = kNoPrimitive;
        x_min = std::min(x_min, x);
        x_max = std::max(x_max, x);
        y_min = std::min(y_min, y);
        y_max = std::max(y_max, y);
      }
      double far_m = 1e6;
      for (const Seen& seen : seen_) {
        if (seen.z_min_m >= far_m) break;
        if (seen.x_min > x_max || seen.x_max < x_min || seen.y_min > y_max || seen.y_max < y_min) continue;
        const Primitive& solid = primitives[seen.primitive];
        const SolidInView view{&solid, solid.R_local_world * T_world_camera.rotation,
                               solid.to_local(T_world_camera.translation)};
        far_m = intersect_tile(view, seen.primitive, tile);
      }
      for (int i = 0; i < kTilePixels; ++i) {
        const int row = row0 + i / kTileSide, column = column0 + i % kTileSide;
        if (row >= height || column >= width) continue;
        const auto pixel = static_cast<std::size_t>(row) * static_cast<std::size_t>(width) +
                           static_cast<std::size_t>(column);
        const auto index = static_cast<std::uint16_t>(tile.solid[i] & 0xffff);
        hits.depth_m[pixel] = index != kNoPrimitive ? static_cast<float>(tile.t_m[i]) : 0.0F;
        hits.primitive[pixel] = index;
        hits.face[pixel] = static_cast<std::uint8_t>(tile.solid[i] >> 16);
      }
    }
}

void Raycaster::find_normals(const T_WorldDepth& T_world_camera, Hits& hits) const {
  const auto primitives = scene_->primitives();
  std::size_t pixel = 0;
  for (int row = 0; row < rays_.height(); ++row)
    for (int column = 0; column < rays_.width(); ++column, ++pixel) {
      Vec3d n;
      if (hits.primitive[pixel] != kNoPrimitive) {
        const Primitive& solid = primitives[hits.primitive[pixel]];
        const auto& m = solid.R_local_world.m;
        if (const int face = hits.face[pixel]; face != 0) {
          const auto axis = static_cast<std::size_t>((face - 1) / 2) * 3;
          n = Vec3d{m[axis], m[axis + 1], m[axis + 2]} * (face % 2 == 0 ? 1.0 : -1.0);
        } else {
          const double z = static_cast<double>(hits.depth_m[pixel]);
          const Vec3d p = T_world_camera * Vec3d{rays_.x(column, row) * z, rays_.y(column, row) * z, z};
          const Vec3d l = local_normal(solid, solid.to_local(p));
          n = {m[0] * l.x + m[3] * l.y + m[6] * l.z, m[1] * l.x + m[4] * l.y + m[7] * l.z,
               m[2] * l.x + m[5] * l.y + m[8] * l.z};
        }
      }
      hits.normal_x[pixel] = static_cast<float>(n.x);
      hits.normal_y[pixel] = static_cast<float>(n.y);
      hits.normal_z[pixel] = static_cast<float>(n.z);
    }
}

}  // namespace tactus::hal::synthetic
