#include "pipeline/render/decal.hpp"

#include <algorithm>
#include <cmath>

#include "pipeline/render/body.hpp"
#include "rt/assert.hpp"

namespace tactus::render {
namespace {

/// A turn about the normal in [0, 2 pi), from the seed (the finaliser of MurmurHash3).
double turn_of(std::uint32_t seed) {
  seed ^= seed >> 16;
  seed *= 0x85ebca6bU;
  seed ^= seed >> 13;
  seed *= 0xc2b2ae35U;
  seed ^= seed >> 16;
  return 6.283185307179586 * seed / 4294967296.0;
}

bool make_instance(const Decal& decal, const T_WorldDepth& T_world_depth, const hal::Intrinsics& camera,
                   const ClipRange& range, DecalInstance& instance) {
  const Vec3d& p = decal.position_world_m;
  const Vec3d normal = decal.normal_world.cast<double>().normalized();
  const auto radius_m = static_cast<double>(decal.radius_m);
  if (decal.kind == DecalKind::none || !(radius_m > 0) || !std::isfinite(p.x + p.y + p.z + radius_m) ||
      !(normal.norm() > 0.5))
    return false;
  const Vec3d center_m = T_world_depth.inverse() * p;
  const double ball_m = std::sqrt(radius_m * radius_m + kDecalThicknessM * kDecalThicknessM);
  if (!cover_ball(center_m, ball_m, camera, range, instance.rectangle_ndc)) return false;
  const Rotation R_depth_world = T_world_depth.rotation.transposed();
  const Vec3d least = std::fabs(normal.y) < 0.7 ? Vec3d{0, 1, 0} : Vec3d{1, 0, 0};
  const Vec3d a = least.cross(normal).normalized(), b = normal.cross(a);
  const double turn = turn_of(decal.seed), c = std::cos(turn), s = std::sin(turn);
  instance.center_depth_m = center_m.cast<float>();
  instance.radius_m = decal.radius_m;
  instance.axis_x_depth = (R_depth_world * (a * c + b * s)).cast<float>();
  instance.axis_y_depth = (R_depth_world * (b * c - a * s)).cast<float>();
  instance.tint = {decal.tint.r, decal.tint.g, decal.tint.b, 255};
  instance.seed = decal.seed;
  return true;
}

}  // namespace

DecalCounts build_decals(std::span<const Decal> decals, const T_WorldDepth& T_world_depth,
                         const hal::Intrinsics& camera, const ClipRange& range,
                         std::span<DecalInstance> instances) noexcept {
  TACTUS_ASSERT(instances.size() >= kDecalsMax);
  DecalCounts counts;
  for (std::size_t kind = 1; kind < kDecalKindsCount; ++kind) {
    counts.first[kind] = counts.total_count;
    for (const Decal& decal : decals.first(std::min(decals.size(), kDecalsMax)))
      if (static_cast<std::size_t>(decal.kind) == kind &&
          make_instance(decal, T_world_depth, camera, range, instances[counts.total_count]))
        ++counts.total_count;
    counts.count[kind] = counts.total_count - counts.first[kind];
  }
  return counts;
}

}  // namespace tactus::render
