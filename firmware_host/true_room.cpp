#include "firmware_host/true_room.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace tactus::firmware {

double Flight::nearest_s(const Vec3d& place_world_m, double time_s_max) const {
  double nearest_s = 0, nearest2 = 1e300;
  for (double t = 0; t <= time_s_max; t += 0.001) {
    const Vec3d way = at(t) - place_world_m;
    if (way.dot(way) >= nearest2) continue;
    nearest2 = way.dot(way);
    nearest_s = t;
  }
  return nearest_s;
}

TrueRoom::TrueRoom(hal::synthetic::Scene scene, const T_WorldDepth& T_scene_depth,
                   const T_WorldDepth& T_world_first)
    : scene_(std::move(scene)),
      T_scene_world_(Transform<Scene, Depth>{T_scene_depth.rotation, T_scene_depth.translation} *
                     T_world_first.inverse()) {}

rt::Result<TrueRoom> TrueRoom::of(const std::string& source, const T_WorldDepth& T_world_first) {
  if (!source.starts_with("synthetic:"))
    return rt::Error{rt::ExitCode::bad_usage,
                     source + " does not know its true surfaces; name a synthetic room."};
  const auto options = hal::parse_synthetic_name(source);
  if (!options) return options.error();
  const auto sensor = hal::open_synthetic(*options);
  if (!sensor) return sensor.error();
  return TrueRoom(hal::synthetic::make_scene(options->scene), sensor->truth.front().T_world_depth,
                  T_world_first);
}

MaterialId TrueRoom::material(const Vec3d& p) const {
  return static_cast<MaterialId>(scene_.material(in_scene(p)));
}

double TrueRoom::distance(const Vec3d& p) const { return scene_.distance(in_scene(p)); }

std::optional<TrueTouch> TrueRoom::first_touch(const Flight& flight, double time_s_max) const {
  constexpr double kTouch_m = 0.001, kStep_s_max = 0.004;
  for (double t = 0; t <= time_s_max;) {
    const Vec3d p = flight.at(t),
                velocity = flight.velocity_world_m_per_s + flight.gravity_world_m_per_s2 * t;
    const double distance_m = distance(p);
    if (distance_m < kTouch_m) {
      const Vec3d normal_scene = scene_.normal(in_scene(p));
      return TrueTouch{p, t, std::max(0.0, -(T_scene_world_.rotation * velocity).dot(normal_scene))};
    }
    // As far as nothing can be, at the speed there is.
    t += std::clamp(distance_m / (velocity.norm() + 1), 1e-5, kStep_s_max);
  }
  return std::nullopt;
}

contact::Outcome outcome_on(const ThingBuild& thing, MaterialId surface, double energy_j,
                            const contact::MaterialTable& table) {
  MaterialDistribution certain{};
  certain[surface] = 1;
  return contact::judge_impact(thing.build, thing.material, table.of(thing.material), certain, energy_j,
                               table)
      .outcome;
}

}  // namespace tactus::firmware
