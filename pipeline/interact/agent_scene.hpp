// What an agent needs of the map: where a ray meets a surface and what that is made of, and how far surfaces
// are.
#pragma once

#include "hal/transform.hpp"
#include "pipeline/map/reader.hpp"

namespace tactus::interact {

/// The map seen through two functions and their context: the live map (scene_of), or an analytic scene in a
/// test. Non-owning, cheap to copy; the context outlives every user. Both functions answer as map::Reader's
/// do: unseen space is no surface, and a surface is hit from its front only. Step phase, one thread at a
/// time: no heap, no lock, bounded.
struct AgentScene {
  using Raycast = bool (*)(const void* context, const Vec3f& origin_world_m, const Vec3f& direction_world,
                           float range_m_max, map::SurfacePoint& out) noexcept;
  using Sample = bool (*)(const void* context, const Vec3f& p_world_m, map::DistanceSample& out) noexcept;

  const void* context = nullptr;
  Raycast raycast_fn = nullptr;
  Sample sample_fn = nullptr;
  float truncation_m = 0.04F;  // distances saturate here

  [[nodiscard]] bool raycast(const Vec3d& origin_world_m, const Vec3d& direction_world, double range_m_max,
                             map::SurfacePoint& out) const noexcept {
    return raycast_fn(context, origin_world_m.cast<float>(), direction_world.cast<float>(),
                      static_cast<float>(range_m_max), out);
  }
  [[nodiscard]] bool sample(const Vec3d& p_world_m, map::DistanceSample& out) const noexcept {
    return sample_fn(context, p_world_m.cast<float>(), out);
  }
};

/// The live map. Any phase; lock-free. `reader` outlives the scene.
inline AgentScene scene_of(const map::Reader& reader) {
  AgentScene scene;
  scene.context = &reader;
  scene.truncation_m = reader.truncation_m();
  scene.raycast_fn = [](const void* context, const Vec3f& origin, const Vec3f& direction, float range_m,
                        map::SurfacePoint& out) noexcept {
    return static_cast<const map::Reader*>(context)->raycast(origin, direction, range_m, out);
  };
  scene.sample_fn = [](const void* context, const Vec3f& p, map::DistanceSample& out) noexcept {
    return static_cast<const map::Reader*>(context)->sample(p, out);
  };
  return scene;
}

}  // namespace tactus::interact
