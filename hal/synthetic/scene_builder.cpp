#include "hal/synthetic/scene_builder.hpp"

#include <cmath>
#include <utility>

#include "hal/synthetic/deterministic_math.hpp"
#include "rt/assert.hpp"

namespace tactus::hal::synthetic {
namespace {

Rotation about_x(double degrees) {
  const auto [s, c] = sin_cos_degrees(degrees);
  return {{1, 0, 0, 0, c, -s, 0, s, c}};
}
Rotation about_y(double degrees) {
  const auto [s, c] = sin_cos_degrees(degrees);
  return {{c, 0, s, 0, 1, 0, -s, 0, c}};
}
Rotation about_z(double degrees) {
  const auto [s, c] = sin_cos_degrees(degrees);
  return {{c, -s, 0, s, c, 0, 0, 0, 1}};
}
Rotation rotation_of(const Tilt& t) {
  return about_y(t.yaw_degrees) * about_x(t.pitch_degrees) * about_z(t.roll_degrees);
}

}  // namespace

FinishId SceneBuilder::finish(Material material, const TextureSpec& texture, float emission) {
  parts_.finishes.push_back({material, static_cast<std::uint16_t>(parts_.textures.size()), emission});
  TextureSpec spec = texture;
  spec.seed = spec.seed * 131 + static_cast<std::uint32_t>(parts_.textures.size());
  parts_.textures.emplace_back(spec);
  return static_cast<FinishId>(parts_.finishes.size() - 1);
}

void SceneBuilder::begin(std::string object_name, const Place& place) {
  parts_.object_names.push_back(std::move(object_name));
  origin_ = place.origin_world_m;
  R_world_object_ = about_y(place.yaw_degrees);
}

void SceneBuilder::add(Shape shape, FinishId finish, const Vec3d& center, const Rotation& R_object_local,
                       double a, double b, double c, double r) {
  TACTUS_ASSERT(!parts_.object_names.empty());
  Primitive p;
  p.shape = shape;
  p.finish = finish;
  p.object = static_cast<std::uint16_t>(parts_.object_names.size() - 1);
  p.a = a;
  p.b = b;
  p.c = c;
  p.r = r;
  p.center_world_m = origin_ + R_world_object_ * center;
  p.R_local_world = (R_world_object_ * R_object_local).transposed();
  update_bounds(p);
  parts_.primitives.push_back(p);
}

void SceneBuilder::box(FinishId finish, const Vec3d& center, const Vec3d& half, double rounding,
                       const Tilt& tilt) {
  TACTUS_ASSERT(rounding <= half.x && rounding <= half.y && rounding <= half.z);
  add(Shape::box, finish, center, rotation_of(tilt), half.x, half.y, half.z, rounding);
}

void SceneBuilder::sphere(FinishId finish, const Vec3d& center, double radius) {
  add(Shape::sphere, finish, center, {}, radius, 0, 0, 0);
}

void SceneBuilder::cylinder(FinishId finish, const Vec3d& bottom, double radius, double height,
                            const Tilt& tilt) {
  const Rotation rotation = rotation_of(tilt);
  add(Shape::cylinder, finish, bottom + rotation * Vec3d{0, height / 2, 0}, rotation, radius, height / 2, 0,
      0);
}

void SceneBuilder::torus(FinishId finish, const Vec3d& center, double ring_radius, double tube_radius,
                         const Tilt& tilt) {
  TACTUS_ASSERT(ring_radius > tube_radius);
  add(Shape::torus, finish, center, rotation_of(tilt), ring_radius, tube_radius, 0, 0);
}

void SceneBuilder::frustum(FinishId finish, const Vec3d& bottom, double radius_bottom, double radius_top,
                           double height) {
  add(Shape::frustum, finish, bottom + Vec3d{0, height / 2, 0}, {}, radius_bottom, height / 2, radius_top, 0);
}

void SceneBuilder::shell(FinishId finish, const Vec3d& bottom, double radius_bottom, double radius_top,
                         double height, double thickness) {
  TACTUS_ASSERT(height > thickness);
  add(Shape::shell, finish, bottom + Vec3d{0, height / 2, 0}, {}, radius_bottom, height / 2 - thickness / 2,
      radius_top, thickness / 2);
}

void SceneBuilder::rod(FinishId finish, const Vec3d& from, const Vec3d& to, double radius) {
  const Vec3d axis = to - from;
  const Vec3d y = axis.normalized();
  const Vec3d x = (std::fabs(y.x) < 0.9 ? Vec3d{1, 0, 0} : Vec3d{0, 0, 1}).cross(y).normalized();
  const Vec3d z = x.cross(y);
  add(Shape::capsule, finish, (from + to) * 0.5, {{x.x, y.x, z.x, x.y, y.y, z.y, x.z, y.z, z.z}}, radius,
      axis.norm() / 2, 0, 0);
}

void SceneBuilder::light(const Vec3d& position_world_m, float strength) {
  parts_.lights.push_back({position_world_m, strength});
}
void SceneBuilder::room(const Vec3d& min_m, const Vec3d& max_m) {
  parts_.room_min_m = min_m;
  parts_.room_max_m = max_m;
}
void SceneBuilder::loop(const LoopSpec& loop) { parts_.loop = loop; }

}  // namespace tactus::hal::synthetic
