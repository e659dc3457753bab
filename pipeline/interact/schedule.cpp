#include "pipeline/interact/schedule.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "pipeline/contact/field_contacts.hpp"

namespace tactus::interact {
namespace {

constexpr double kProbeRadiusM = 0.01;
constexpr double kFallMaxM = 1.5;
constexpr double kAimRangeM = 6;      // nothing real on the way: as if there were something here
constexpr double kHandBelowEyeM = 0.12;
// Nearest first; 5 cm apart, as far as 0.2 m: 0.6 to 1.0 m for the built-in drop.
constexpr std::array<double, 9> kOffsetsM = {0, -0.05, 0.05, -0.1, 0.1, -0.15, 0.15, -0.2, 0.2};

Vec3d view_direction(const T_WorldDepth& T_world_depth) { return T_world_depth.rotation * Vec3d{0, 0, 1}; }

std::optional<Vec3d> place_at(const contact::Shape& shape, double distance_m, double above_m,
                              const T_WorldDepth& T_world_depth, const Vec3d& down,
                              const contact::DistanceField& field) {
  const contact::Shape probe = contact::Shape::sphere(kProbeRadiusM);
  const Vec3d eye = T_world_depth.translation;
  const Vec3d forward = view_direction(T_world_depth) * distance_m;
  if (contact::free_fraction(field, probe, eye, {}, forward) < 1) return std::nullopt;
  const double fraction = contact::free_fraction(field, probe, eye + forward, {}, down * kFallMaxM);
  if (fraction >= 1) return std::nullopt;
  const Vec3d surface = eye + forward + down * (kFallMaxM * fraction + kProbeRadiusM);
  const double up_m = above_m + contact::reach_m(shape);
  // Free all the way down means also that the body does not start inside a shelf above.
  const double way_m = std::max(0.0, above_m - 0.01);
  const Vec3d start = surface - down * up_m;
  if (contact::free_fraction(field, shape, start, {}, down * way_m) < 1) return std::nullopt;
  return start;
}

}  // namespace

std::optional<Vec3d> place_above_surface(const contact::Shape& shape, double distance_m, double above_m,
                                         const T_WorldDepth& T_world_depth, const Vec3d& gravity_world,
                                         const contact::DistanceField& field) noexcept {
  const Vec3d down = gravity_world.normalized();
  if (down == Vec3d{}) return std::nullopt;
  for (const double offset_m : kOffsetsM) {
    if (distance_m + offset_m <= 0.1) continue;
    const auto start = place_at(shape, distance_m + offset_m, above_m, T_world_depth, down, field);
    if (start) return start;
  }
  return std::nullopt;
}

AimedRay aimed_ray(const Aim& aim, const View& view) noexcept {
  const Vec3d eye = view.T_world_picture.translation;
  if (aim.target_world_m) {
    const Vec3d way = *aim.target_world_m - eye;
    if (way.dot(way) > 0) return {eye, way.normalized()};
  }
  const hal::Intrinsics& c = view.picture_camera;
  const double u = aim.pixel ? (*aim.pixel)[0] : 0.5 * c.width, v = aim.pixel ? (*aim.pixel)[1] : 0.5 * c.height;
  return {eye, (view.T_world_picture.rotation * Vec3d{(u - c.cx) / c.fx, (v - c.cy) / c.fy, 1}).normalized()};
}

Vec3d velocity_to_hit(const Vec3d& from, const Vec3d& target, double speed, const Vec3d& gravity) noexcept {
  const Vec3d way = target - from;
  const double time = way.norm() / speed;
  if (!(time > 0)) return {};
  return way * (1 / time) - gravity * (0.5 * time);
}

namespace {

Start aimed_start(const Throw& what, const View& view, const Vec3d& gravity_world,
                  const contact::DistanceField& room) {
  const AimedRay ray = aimed_ray(what.aim, view);
  Vec3d target = what.aim.target_world_m.value_or(ray.origin_world_m + ray.direction_world * kAimRangeM);
  map::SurfacePoint surface;
  if (!what.aim.target_world_m && room.raycast(ray.origin_world_m, ray.direction_world, kAimRangeM, surface))
    target = surface.position_world_m.cast<double>();
  Vec3d from = ray.origin_world_m + ray.direction_world * what.in_front_m + gravity_world.normalized() * kHandBelowEyeM;
  from = what.position_world_m.value_or(from);
  return {from, velocity_to_hit(from, target, what.speed_m_per_s, gravity_world) + what.velocity_world_m_per_s};
}

Start straight_start(const Throw& what, const View& view) {
  const Vec3d forward = view_direction(view.T_world_depth);
  return {what.position_world_m.value_or(view.T_world_depth.translation + forward * what.in_front_m),
          what.velocity_world_m_per_s + forward * what.speed_m_per_s};
}

}  // namespace

std::optional<Start> start_of(const Throw& what, const View& view, const Vec3d& gravity_world,
                              const contact::DistanceField& room) noexcept {
  if (what.aim.is_set()) return aimed_start(what, view, gravity_world, room);
  Start start = straight_start(what, view);
  if (!what.above_surface_m || what.position_world_m) return start;
  const auto placed = place_above_surface(what.shape, what.in_front_m, *what.above_surface_m, view.T_world_depth,
                                          gravity_world, room);
  if (!placed) return std::nullopt;
  start.position_world_m = *placed;
  return start;
}

Schedule::Schedule(Script script)
    : script_(std::move(script)),
      throw_states_(script_.throws.size()),
      shot_states_(script_.shots.size()),
      left_(script_.throws.size() + script_.shots.size()) {}

std::size_t Schedule::due_throws(std::uint64_t frames, rt::Duration since_tracking, const View& view,
                                 const Vec3d& gravity_world, const contact::DistanceField& room,
                                 std::span<DueThrow> out) noexcept {
  std::size_t count = 0;
  for (std::size_t i = 0; i < script_.throws.size() && count < out.size(); ++i) {
    const Throw& what = script_.throws[i];
    State& state = throw_states_[i];
    if (state.done || !what.when.is_due(frames, since_tracking)) continue;

    const auto start = start_of(what, view, gravity_world, room);
    if (!start) {
      if (!state.waiting_since) state.waiting_since = since_tracking;
      if (since_tracking - *state.waiting_since < kWait) continue;
    }
    out[count++] = {i, start.value_or(straight_start(what, view))};
    state.done = true;
    --left_;
  }
  return count;
}

std::size_t Schedule::due_shots(std::uint64_t frames, rt::Duration since_tracking,
                                std::span<std::size_t> out) noexcept {
  std::size_t count = 0;
  for (std::size_t i = 0; i < script_.shots.size() && count < out.size(); ++i) {
    if (shot_states_[i].done || !script_.shots[i].when.is_due(frames, since_tracking)) continue;
    out[count++] = i;
    shot_states_[i].done = true;
    --left_;
  }
  return count;
}

}  // namespace tactus::interact
