#include "pipeline/interact/drop_script.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "pipeline/contact/field_contacts.hpp"

namespace tactus::interact {
namespace {

constexpr double kProbeRadiusM = 0.01;
constexpr double kFallMaxM = 1.5;
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
  const double up_m = above_m + reach_m(shape);
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

std::vector<Throw> default_drop_script() {
  Throw ball;
  ball.at_time = rt::Duration{1'000'000'000};
  ball.shape = contact::Shape::sphere(0.05);
  ball.in_front_m = 0.8;
  ball.above_surface_m = 0.4;
  return {ball};
}

DropScript::DropScript(std::vector<Throw> throws) {
  entries_.reserve(throws.size());
  for (Throw& what : throws) entries_.push_back({std::move(what), false, std::nullopt});
  left_ = entries_.size();
}

std::size_t DropScript::due(std::uint64_t frames, rt::Duration since_tracking,
                            const T_WorldDepth& T_world_depth, const Vec3d& gravity_world,
                            const contact::DistanceField& field, std::span<contact::BodySpec> out) noexcept {
  std::size_t count = 0;
  for (Entry& entry : entries_) {
    if (count == out.size()) break;
    const Throw& what = entry.what;
    const bool is_due = what.at_frame ? frames >= *what.at_frame : since_tracking >= *what.at_time;
    if (entry.done || !is_due) continue;

    const Vec3d view = view_direction(T_world_depth);
    Vec3d position = what.position_world_m.value_or(T_world_depth.translation + view * what.in_front_m);
    if (!what.position_world_m && what.above_surface_m) {
      const auto placed = place_above_surface(what.shape, what.in_front_m, *what.above_surface_m,
                                              T_world_depth, gravity_world, field);
      if (placed) {
        position = *placed;
      } else {
        if (!entry.waiting_since) entry.waiting_since = since_tracking;
        if (since_tracking - *entry.waiting_since < kWait) continue;
      }
    }
    contact::BodySpec& spec = out[count++];
    spec = {};
    spec.shape = what.shape;
    spec.material = what.material;
    spec.position_world_m = position;
    spec.velocity_world_m_per_s = what.velocity_world_m_per_s + view * what.speed_m_per_s;
    entry.done = true;
    --left_;
  }
  return count;
}

}  // namespace tactus::interact
