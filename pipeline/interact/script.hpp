// What happens in the room, and when: a script from a TOML file, or one that comes with an app.
//
//   [[throw]]                       # something with a body
//   at_s = 1.0                      # after tracking began; or at_frame = 30, of the sensor, the first being 1
//   thing = "plate"                 # "plate" or "cup", which break; or a plain shape:
//   shape = "sphere"                #   sphere and its radius_m, box and its size_m = [x, y, z] (edges),
//   radius_m = 0.05                 #   capsule and cylinder, which stand along z: radius_m and length_m
//   material = "plastic"            #   one of the 23
//   in_front_m = 0.8                # from the camera along its view; or position_m = [x, y, z] in the world
//   above_surface_m = 0.4           # optional, with in_front_m: start this high above the real surface below
//   aim_px = [320, 240]             # optional: the pixel of the picture to be hit; or target_m = [x, y, z]
//   speed_m_per_s = 0.0             # along the view, or of the throw that hits what is aimed at
//   velocity_m_per_s = [0, 0, 0]    # optional, world, on top
//   spin_rad_per_s = [0, 0, 0]      # optional, world
//
//   [[shot]]
//   at_s = 2.0                      # or at_frame
//   aim_px = [320, 240]             # else the middle of the picture; or target_m
//   energy_j = 60
//   projectile_m_per_s = 100        # optional: a bullet that flies; else a ray that is there at once
//
//   [[walker]]                      # a small figure that walks on the floor; at most two
//   at_s = 1.0                      # or at_frame
//   in_front_m = 1.0                # on the floor there, level along the view; or position_m = [x, y, z]: the ground below
//   wander = 1                      # goals of its own choice, drawn from this seed; or goal_m = [x, y, z]
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hal/transform.hpp"
#include "pipeline/contact/shape.hpp"
#include "pipeline/interact/things.hpp"
#include "rt/status.hpp"
#include "rt/time.hpp"

namespace tactus::interact {

/// When, by frames or by time since tracking began; exactly one is set.
struct Moment {
  std::optional<std::uint64_t> at_frame;
  std::optional<rt::Duration> at_time;

  [[nodiscard]] bool is_due(std::uint64_t frames, rt::Duration since_tracking) const {
    return at_frame ? frames >= *at_frame : since_tracking >= *at_time;
  }
};

/// Where to; nothing: the middle of the picture.
struct Aim {
  std::optional<std::array<double, 2>> pixel;  // of the picture
  std::optional<Vec3d> target_world_m;
  [[nodiscard]] bool is_set() const { return pixel || target_world_m; }
};

struct Throw {
  Moment when;
  ThingKind thing = ThingKind::plain;
  contact::Shape shape;                                  // of a plain thing
  MaterialId material = material_from_name("plastic");   // of a plain thing
  std::optional<Vec3d> position_world_m;                 // unset: in front of the camera
  double in_front_m = 0.8;
  std::optional<double> above_surface_m;
  Aim aim;
  double speed_m_per_s = 0;
  Vec3d velocity_world_m_per_s, spin_world_rad_per_s;
};

struct Shot {
  Moment when;
  Aim aim;
  double energy_j = 60;             // of a small pistol's bullet
  double projectile_m_per_s = 0;    // 0: a ray
};

struct Walker {
  Moment when;
  std::optional<Vec3d> position_world_m;  // unset: in front of the camera
  double in_front_m = 1;
  std::optional<Vec3d> goal_world_m;  // unset: it wanders
  std::uint64_t wander_seed = 1;
};

struct Script {
  std::vector<Throw> throws;
  std::vector<Shot> shots;
  std::vector<Walker> walkers;
};

inline constexpr std::size_t kEntriesMax = 256;  // of throws, of shots
inline constexpr std::size_t kWalkersMax = 2;

/// Reads a script. Errors: one sentence with file, line and key, exit code bad_usage. Boot.
rt::Result<Script> parse_script(std::string_view toml, const std::string& file_name);
rt::Result<Script> load_script(const std::string& path);

/// What an app does where no script says it. `none`: a ball is dropped onto the nearest surface, and three are tossed
/// along the view. `shooting`: a shot every half second over a grid of the picture, every third one a flying bullet.
/// `plates`: a plate every second, over the same grid. In both a walker wanders from the first second on. Boot.
enum class App : std::uint8_t { none, shooting, plates };
Script default_script(App app, int picture_width_px, int picture_height_px);

}  // namespace tactus::interact
