// What touch needs of the map: a distance with its gradient, what the surface is made of, and what a ray meets.
#pragma once

#include <span>

#include "hal/transform.hpp"
#include "pipeline/label/material.hpp"
#include "pipeline/map/reader.hpp"

namespace tactus::contact {

/// A signed distance field, seen through functions and their context: the live map (map_field.hpp) or
/// an analytic scene in a test. Non-owning and cheap to copy; the context must outlive every user. The
/// functions run in the step phase: no heap, no lock, bounded; they may be called from one thread at a time.
struct DistanceField {
  /// False where the place was never observed. Otherwise metres to the surface, positive in front, saturated
  /// at
  /// +-truncation_m, and the unit gradient towards free space (zero where flat). The distance may be
  /// projective, that is, longer than the true one by 1/cos of the viewing angle; its zero level set is
  /// exact.
  using Sample = bool (*)(const void* context, const Vec3f& p_world_m, map::DistanceSample& out) noexcept;
  /// The same distances of many points without their gradients, for less; map::kUnknownDistanceM where sample
  /// answers false. Null: samples them one by one.
  using Distances = void (*)(const void* context, std::span<const Vec3f> points_world_m,
                             std::span<float> distances_m) noexcept;
  /// Posterior of the surface nearest to p; false when nothing has labelled it.
  using Materials = bool (*)(const void* context, const Vec3f& p_world_m, MaterialDistribution& out) noexcept;

  /// First surface along a ray, seen from its front, within range_m; false when there is none.
  using Raycast = bool (*)(const void* context, const Vec3f& origin_world_m, const Vec3f& direction_world, float range_m,
                           map::SurfacePoint& out) noexcept;

  const void* context = nullptr;
  Sample sample_fn = nullptr;
  Distances distances_fn = nullptr;
  Materials materials_fn = nullptr;
  Raycast raycast_fn = nullptr;  // null: rays meet nothing
  float truncation_m = 0.04F;
  /// The distance changes by at most this much per way, as long as the field holds still. A trilinear one of
  /// 4 voxels' truncation: 2 sqrt(3) * 4, where neighbours lie before and behind the edge of something.
  float slope_max = 14;

  [[nodiscard]] bool sample(const Vec3d& p_world_m, map::DistanceSample& out) const noexcept {
    return sample_fn(context, p_world_m.cast<float>(), out);
  }
  [[nodiscard]] bool distance(const Vec3d& p_world_m, double& distance_m) const noexcept {
    const Vec3f p = p_world_m.cast<float>();
    float answer_m = 0;
    distances({&p, 1}, {&answer_m, 1});
    distance_m = static_cast<double>(answer_m);
    return answer_m != map::kUnknownDistanceM;
  }
  void distances(std::span<const Vec3f> points_world_m, std::span<float> distances_m) const noexcept {
    if (distances_fn != nullptr) {
      distances_fn(context, points_world_m, distances_m);
      return;
    }
    for (std::size_t i = 0; i < points_world_m.size(); ++i) {
      map::DistanceSample both;
      const bool known = sample_fn(context, points_world_m[i], both);
      distances_m[i] = known ? both.distance_m : map::kUnknownDistanceM;
    }
  }
  [[nodiscard]] bool raycast(const Vec3d& origin_world_m, const Vec3d& direction_world, double range_m,
                             map::SurfacePoint& out) const noexcept {
    return raycast_fn != nullptr && raycast_fn(context, origin_world_m.cast<float>(), direction_world.cast<float>(),
                                               static_cast<float>(range_m), out);
  }
  [[nodiscard]] bool materials(const Vec3d& p_world_m, MaterialDistribution& out) const noexcept {
    return materials_fn(context, p_world_m.cast<float>(), out);
  }
};

/// A room that only rays are cast into.
inline DistanceField rays_only(const void* context, DistanceField::Raycast raycast) {
  DistanceField field;
  field.context = context;
  field.raycast_fn = raycast;
  return field;
}

}  // namespace tactus::contact
