// A synthetic room as it truly is, in the world of a run: what a thrown thing would meet there, and what that
// would do to it.
#pragma once

#include <optional>
#include <string>

#include "hal/synthetic/synthetic.hpp"
#include "hal/transform.hpp"
#include "pipeline/contact/fracture.hpp"

namespace tactus::firmware {

/// Where a thing's path first meets a true surface.
struct TrueTouch {
  Vec3d position_world_m;
  double time_s = 0;            // since the throw
  double approach_m_per_s = 0;  // along the surface's normal
};

struct Flight {
  Vec3d start_world_m, velocity_world_m_per_s, gravity_world_m_per_s2{0, -9.81, 0};

  [[nodiscard]] Vec3d at(double time_s) const {
    return start_world_m + velocity_world_m_per_s * time_s + gravity_world_m_per_s2 * (0.5 * time_s * time_s);
  }
  /// Where the path is nearest to a place, seconds from the throw, 0 .. time_s_max, to a millisecond.
  [[nodiscard]] double nearest_s(const Vec3d& place_world_m, double time_s_max) const;
};

class TrueRoom {
 public:
  /// `T_world_first`: the pose of the source's first frame in the run's world. bad_usage when the source is
  /// not a synthetic one. Boot.
  static rt::Result<TrueRoom> of(const std::string& source, const T_WorldDepth& T_world_first);

  /// Of the nearest true surface. Any phase.
  [[nodiscard]] MaterialId material(const Vec3d& p_world_m) const;
  /// Metres to it, negative inside.
  [[nodiscard]] double distance(const Vec3d& p_world_m) const;
  /// Of the middle of a thing, which is taken as a point; nothing within time_s_max.
  [[nodiscard]] std::optional<TrueTouch> first_touch(const Flight& flight, double time_s_max) const;

 private:
  struct Scene;  // frame of the room
  TrueRoom(hal::synthetic::Scene scene, const T_WorldDepth& T_scene_depth, const T_WorldDepth& T_world_first);
  [[nodiscard]] Vec3d in_scene(const Vec3d& p_world_m) const { return T_scene_world_ * p_world_m; }

  hal::synthetic::Scene scene_;
  Transform<Scene, World> T_scene_world_;
};

/// What of a thing decides what an impact does to it.
struct ThingBuild {
  contact::Build build;
  MaterialId material = kUnknownMaterial;
};

/// What an impact of this energy does to a thing on a surface that is certainly of this material. Pure.
contact::Outcome outcome_on(const ThingBuild& thing, MaterialId surface, double energy_j,
                            const contact::MaterialTable& table);

}  // namespace tactus::firmware
