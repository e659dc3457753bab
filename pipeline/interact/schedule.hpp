// Plays a script: what is due, from where, and how fast.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "hal/calibration.hpp"
#include "pipeline/contact/distance_field.hpp"
#include "pipeline/interact/script.hpp"

namespace tactus::interact {

/// Where a person stands and looks: the newest frame.
struct View {
  T_WorldDepth T_world_depth;
  hal::Intrinsics picture_camera;   // that pixels are aimed in; no distortion
  T_WorldDepth T_world_picture;     // its pose
  /// The real surfaces that are aimed at, whether or not they stop what is thrown. Without functions: those that do.
  contact::DistanceField seen{};
};

/// A ray into the room, unit direction.
struct AimedRay {
  Vec3d origin_world_m, direction_world;
};
/// Through what is aimed at; the middle of the picture when nothing is. Any phase.
AimedRay aimed_ray(const Aim& aim, const View& view) noexcept;

/// How a thing starts.
struct Start {
  Vec3d position_world_m, velocity_world_m_per_s;
};
/// Where a throw begins: aimed at something, it is thrown so that it comes by the target, or by the first real surface on
/// the way there. Nothing when it is to be dropped over a surface that is not known (yet). Step phase; bounded.
std::optional<Start> start_of(const Throw& what, const View& view, const Vec3d& gravity_world,
                              const contact::DistanceField& room) noexcept;

/// A throw that is due, by its number in the script.
struct DueThrow {
  std::size_t index = 0;
  Start start;
};

/// Thread-bound.
class Schedule {
 public:
  Schedule() = default;
  explicit Schedule(Script script);  // boot

  /// Writes the throws that are due now into `out` and returns how many; what does not fit comes with the next call. A
  /// throw with above_surface_m looks for the surface at its distance, then up to 0.2 m nearer and farther; until the map
  /// knows one it waits, at most kWait, and then is released straight in front. Step phase: no heap, bounded.
  std::size_t due_throws(std::uint64_t frames_since_tracking, rt::Duration since_tracking, const View& view,
                         const Vec3d& gravity_world, const contact::DistanceField& room,
                         std::span<DueThrow> out) noexcept;
  /// The same for shots: their numbers in the script.
  std::size_t due_shots(std::uint64_t frames_since_tracking, rt::Duration since_tracking,
                        std::span<std::size_t> out) noexcept;

  [[nodiscard]] const Throw& throw_at(std::size_t index) const { return script_.throws[index]; }
  [[nodiscard]] const Shot& shot_at(std::size_t index) const { return script_.shots[index]; }
  [[nodiscard]] std::size_t left() const { return left_; }

  static constexpr rt::Duration kWait{5'000'000'000};

 private:
  struct State {
    bool done = false;
    std::optional<rt::Duration> waiting_since;
  };
  Script script_;
  std::vector<State> throw_states_, shot_states_;  // sized at boot
  std::size_t left_ = 0;
};

/// Velocity that takes a thing from `from` through `target` at about `speed` under gravity. Any phase.
Vec3d velocity_to_hit(const Vec3d& from_world_m, const Vec3d& target_world_m, double speed_m_per_s,
                      const Vec3d& gravity_world) noexcept;

/// Where a body of this size starts `above_m` over the real surface near `distance_m` in front of the camera;
/// nothing where no surface is known below, or something real stands between. Step phase; bounded.
std::optional<Vec3d> place_above_surface(const contact::Shape& shape, double distance_m, double above_m,
                                         const T_WorldDepth& T_world_depth, const Vec3d& gravity_world,
                                         const contact::DistanceField& field) noexcept;

}  // namespace tactus::interact
