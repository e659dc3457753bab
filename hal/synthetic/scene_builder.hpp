// Verbs to furnish a room: objects at places, made of solids. Boot only.
#pragma once

#include <cstdint>
#include <string>

#include "hal/synthetic/scene.hpp"

namespace tactus::hal::synthetic {

/// Where an object stands: its own frame (y up, front along +z) in the world.
struct Place {
  Vec3d origin_world_m;
  double yaw_degrees = 0;  // about +y, counter-clockwise from above
};

/// Rotation of a solid inside its object, applied yaw first, then pitch (about x), then roll (about z).
struct Tilt {
  double yaw_degrees = 0, pitch_degrees = 0, roll_degrees = 0;
};

using FinishId = std::uint16_t;

class SceneBuilder {
 public:
  FinishId finish(Material material, const TextureSpec& texture, float emission = 0);

  /// Everything that follows belongs to this object and is given in its frame.
  void begin(std::string object_name, const Place& place);
  /// As begin() with the object's frame at the world's.
  void begin(std::string object_name) { begin(std::move(object_name), {}); }

  void box(FinishId finish, const Vec3d& center, const Vec3d& half_extents, double rounding = 0,
           const Tilt& tilt = {});
  void sphere(FinishId finish, const Vec3d& center, double radius);
  void cylinder(FinishId finish, const Vec3d& bottom, double radius, double height, const Tilt& tilt = {});
  void torus(FinishId finish, const Vec3d& center, double ring_radius, double tube_radius,
             const Tilt& tilt = {});
  void frustum(FinishId finish, const Vec3d& bottom, double radius_bottom, double radius_top, double height);
  void shell(FinishId finish, const Vec3d& bottom, double radius_bottom, double radius_top, double height,
             double thickness);
  /// Round-ended rod from one point to another.
  void rod(FinishId finish, const Vec3d& from, const Vec3d& to, double radius);

  void light(const Vec3d& position_world_m, float strength);
  void room(const Vec3d& min_m, const Vec3d& max_m);
  void loop(const LoopSpec& loop);

  [[nodiscard]] Scene::Parts take() { return std::move(parts_); }

 private:
  void add(Shape shape, FinishId finish, const Vec3d& center, const Rotation& R_object_local, double a,
           double b, double c, double r);
  Scene::Parts parts_;
  Vec3d origin_;
  Rotation R_world_object_;
};

}  // namespace tactus::hal::synthetic
