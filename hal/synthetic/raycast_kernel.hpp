// The SIMD kernel under Raycaster: one solid against the rays of one tile.
#pragma once

#include <cstdint>

#include "hal/synthetic/primitive.hpp"

namespace tactus::hal::synthetic {

/// Rays o + t d of a tile with d = (x, y, 1) in the camera's frame, so that t is depth.
struct alignas(64) TileRays {
  static constexpr int kCount = 256;
  double x[kCount], y[kCount];
  double t_m[kCount];          // nearest hit so far
  std::int64_t solid[kCount];  // index of its solid | face << 16, see Face
};

/// A solid as a camera sees it.
struct SolidInView {
  const Primitive* solid;
  Rotation R_local_camera;
  Vec3d origin_local_m;  // the camera
};

/// Lowers t_m and sets `solid` where the solid is nearer; returns the largest t_m of the tile afterwards.
double intersect_tile(const SolidInView& view, std::int64_t primitive_index, TileRays& rays);

}  // namespace tactus::hal::synthetic
