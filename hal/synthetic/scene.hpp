// A synthetic room as truth: exact signed distance, normal, material and colour at any point.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "hal/synthetic/material.hpp"
#include "hal/synthetic/primitive.hpp"
#include "hal/synthetic/texture.hpp"
#include "hal/transform.hpp"

namespace tactus::hal::synthetic {

/// `wall` is one flat textured wall and nothing else, `corner` three orthogonal planes: for degenerate
/// tracking.
enum class SceneId : std::uint8_t { bedroom, office, wall, corner };
inline constexpr int kScenesCount = 4;
const char* name(SceneId scene);

/// What a surface is made of and looks like.
struct Finish {
  Material material = Material::other;
  std::uint16_t texture = 0;
  float emission = 0;  // 0: lit by the room, 1: its own light (lamp shades, sky)
};

/// Where the hand-held camera goes: a closed loop about `center`, see trajectory.hpp.
struct LoopSpec {
  Vec3d center_world_m;
  double yaw_degrees = 0, pitch_degrees = 0;    // of the view at the loop's middle; yaw 0 looks along -z
  double right_m = 0, up_m = 0, forward_m = 0;  // amplitudes
  double yaw_sweep_degrees = 0, pitch_sweep_degrees = 0, roll_sweep_degrees = 0;
};

struct Light {
  Vec3d position_world_m;
  float strength = 1;  // at 1 m and normal incidence, falling with 1 / (1 + (d/3 m)^2)
};

/// World frame: metres, y up, gravity along -y, floor at y = 0.
///
/// The room is a union of solids. distance() is exact everywhere outside of them; inside a solid it is exact
/// for that solid and therefore a lower bound in magnitude where solids overlap. All members are immutable
/// after construction: every query may run on any thread, wait-free, and answers the same bits on every
/// machine.
class Scene {
 public:
  struct Parts {
    std::vector<Primitive> primitives;
    std::vector<Finish> finishes;
    std::vector<Texture> textures;
    std::vector<std::string> object_names;
    std::vector<Light> lights;
    Vec3d room_min_m, room_max_m;  // the inside of the room
    LoopSpec loop;
  };

  /// Boot; computes the distance grid.
  explicit Scene(Parts parts);

  /// Signed distance to the nearest surface, metres.
  [[nodiscard]] double distance(const Vec3d& p_world_m) const;
  [[nodiscard]] float distance(const Vec3f& p_world_m) const {
    return static_cast<float>(distance(p_world_m.cast<double>()));
  }
  /// Material of the nearest surface.
  [[nodiscard]] Material material(const Vec3d& p_world_m) const;
  /// Gradient of distance(): unit, into free space.
  [[nodiscard]] Vec3d normal(const Vec3d& p_world_m) const;
  /// Colour of the nearest surface without light.
  [[nodiscard]] Rgb8 albedo(const Vec3d& p_world_m) const;

  /// The nearest solid to a point and its distance.
  struct Nearest {
    std::size_t primitive_index = 0;
    double distance_m = 0;
  };
  [[nodiscard]] Nearest nearest(const Vec3d& p_world_m) const;

  /// distance() on a coarse grid over the room, for soft contact shadows: sizes x, y, z with x running
  /// fastest.
  struct DistanceGrid {
    Vec3f origin_m;
    float cell_m = 0;
    std::array<int, 3> size{};
    std::vector<float> distance_m;
  };
  [[nodiscard]] const DistanceGrid& grid() const { return grid_; }

  [[nodiscard]] std::span<const Primitive> primitives() const { return parts_.primitives; }
  [[nodiscard]] std::span<const Finish> finishes() const { return parts_.finishes; }
  [[nodiscard]] std::span<const Texture> textures() const { return parts_.textures; }
  [[nodiscard]] std::span<const std::string> object_names() const { return parts_.object_names; }
  [[nodiscard]] std::span<const Light> lights() const { return parts_.lights; }
  [[nodiscard]] const LoopSpec& loop() const { return parts_.loop; }
  [[nodiscard]] Vec3d room_min_m() const { return parts_.room_min_m; }
  [[nodiscard]] Vec3d room_max_m() const { return parts_.room_max_m; }

 private:
  Parts parts_;
  DistanceGrid grid_;
};

/// Builds a room (0.1 s, 3 MB). Boot.
[[nodiscard]] Scene make_scene(SceneId scene);

}  // namespace tactus::hal::synthetic
