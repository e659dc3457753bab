// What is thrown into the room, and when: a script from a TOML file, or the built-in drop of one ball.
//
//   [[throw]]
//   at_s = 1.0                      # after tracking began; or at_frame = 30
//   shape = "sphere"                # with radius_m; or "box" with size_m = [x, y, z] (edges)
//   radius_m = 0.05
//   material = "plastic"            # one of the 23
//   in_front_m = 0.8                # from the camera along its view; or position_m = [x, y, z] in the world
//   above_surface_m = 0.4           # optional, with in_front_m: start this high above the real surface below
//   velocity_m_per_s = [0, 0, 0]    # optional, world
//   speed_m_per_s = 0.0             # optional, added along the view
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "hal/transform.hpp"
#include "pipeline/contact/world.hpp"
#include "rt/status.hpp"
#include "rt/time.hpp"

namespace tactus::interact {

struct Throw {
  std::optional<std::uint64_t> at_frame;  // frames since tracking began; exactly one of the two is set
  std::optional<rt::Duration> at_time;    // since tracking began
  contact::Shape shape;
  MaterialId material = material_from_name("plastic");
  std::optional<Vec3d> position_world_m;  // unset: in front of the camera
  double in_front_m = 0.8;
  std::optional<double> above_surface_m;
  Vec3d velocity_world_m_per_s;
  double speed_m_per_s = 0;  // along the camera's view
};

inline constexpr std::size_t kThrowsMax = 256;

/// Reads a script. Errors: one sentence with file, line and key, exit code bad_usage. Boot.
rt::Result<std::vector<Throw>> parse_drop_script(std::string_view toml, const std::string& file_name);
rt::Result<std::vector<Throw>> load_drop_script(const std::string& path);

/// One ball of 5 cm, one second after tracking began, 0.4 m above the real surface 0.6 to 1.0 m in front of
/// the camera.
std::vector<Throw> default_drop_script();

/// Plays a script. Thread-bound.
class DropScript {
 public:
  DropScript() = default;
  explicit DropScript(std::vector<Throw> throws);  // boot

  /// Writes what is due now into `out` and returns how many; what does not fit comes with the next call. A
  /// throw with above_surface_m looks for the surface at its distance, then up to 0.2 m nearer and farther;
  /// until the map knows one it waits, at most kWait, and then is released straight in front. Step phase: no
  /// heap, bounded.
  std::size_t due(std::uint64_t frames_since_tracking, rt::Duration since_tracking,
                  const T_WorldDepth& T_world_depth, const Vec3d& gravity_world,
                  const contact::DistanceField& field, std::span<contact::BodySpec> out) noexcept;

  [[nodiscard]] std::size_t throws_left() const { return left_; }

  static constexpr rt::Duration kWait{5'000'000'000};

 private:
  struct Entry {
    Throw what;
    bool done = false;
    std::optional<rt::Duration> waiting_since;
  };
  std::vector<Entry> entries_;  // sized at boot
  std::size_t left_ = 0;
};

/// Where a body of this size starts `above_m` over the real surface near `distance_m` in front of the camera;
/// nothing where no surface is known below, or something real stands between. Step phase; bounded.
std::optional<Vec3d> place_above_surface(const contact::Shape& shape, double distance_m, double above_m,
                                         const T_WorldDepth& T_world_depth, const Vec3d& gravity_world,
                                         const contact::DistanceField& field) noexcept;

}  // namespace tactus::interact
