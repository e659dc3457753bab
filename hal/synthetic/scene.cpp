#include "hal/synthetic/scene.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "hal/synthetic/rooms.hpp"
#include "rt/assert.hpp"

namespace tactus::hal::synthetic {
namespace {
constexpr double kGridCell_m = 0.1;
constexpr double kOpennessReach_m = 0.18;  // a solid this near in front of a surface begins to shade it
}  // namespace

const char* name(SceneId scene) {
  constexpr std::array<const char*, kScenesCount> kNames = {"bedroom", "office", "wall", "corner"};
  return kNames[static_cast<std::size_t>(scene)];
}

Scene make_scene(SceneId scene) {
  switch (scene) {
    case SceneId::bedroom:
      return Scene(make_bedroom());
    case SceneId::office:
      return Scene(make_office());
    case SceneId::wall:
      return Scene(make_wall());
    case SceneId::corner:
      break;
  }
  return Scene(make_corner());
}

Scene::Scene(Parts parts) : parts_(std::move(parts)) {
  TACTUS_ASSERT(!parts_.primitives.empty());
  const Vec3d extent = parts_.room_max_m - parts_.room_min_m;
  grid_size_ = {static_cast<int>(extent.x / kGridCell_m) + 2, static_cast<int>(extent.y / kGridCell_m) + 2,
                static_cast<int>(extent.z / kGridCell_m) + 2};
  for (int z = 0; z < grid_size_[2]; ++z)
    for (int y = 0; y < grid_size_[1]; ++y)
      for (int x = 0; x < grid_size_[0]; ++x)
        grid_distance_m_.push_back(static_cast<float>(
            nearest(parts_.room_min_m + Vec3d{x * kGridCell_m, y * kGridCell_m, z * kGridCell_m})
                .distance_m));
}

Scene::Nearest Scene::nearest(const Vec3d& p) const {
  Nearest best{0, 1e30};
  for (std::size_t i = 0; i < parts_.primitives.size(); ++i) {
    const Primitive& s = parts_.primitives[i];
    const Vec3d offset = p - s.center_world_m;
    // The bounding sphere first: only solids that can be nearer are evaluated.
    const double reach = best.distance_m + s.bound_radius_m;
    if (reach < 0 || offset.dot(offset) > reach * reach) continue;
    const double d = local_distance(s, s.R_local_world * offset);
    if (d < best.distance_m) best = {i, d};
  }
  return best;
}

double Scene::distance(const Vec3d& p) const { return nearest(p).distance_m; }

Material Scene::material(const Vec3d& p) const {
  return parts_.finishes[parts_.primitives[nearest(p).primitive_index].finish].material;
}

Vec3d Scene::normal(const Vec3d& p) const {
  const Primitive& s = parts_.primitives[nearest(p).primitive_index];
  return s.R_local_world.transposed() * local_normal(s, s.to_local(p));
}

Rgb8 Scene::albedo(const Vec3d& p) const {
  const Primitive& s = parts_.primitives[nearest(p).primitive_index];
  const Vec3d p_local = s.to_local(p);
  return surface_color(*this, s, p_local, local_normal(s, p_local), 0);
}

float Scene::openness(const Vec3d& p, const Vec3d& normal) const {
  const Vec3d q = p + normal * kOpennessReach_m - parts_.room_min_m;
  const double gx = q.x / kGridCell_m, gy = q.y / kGridCell_m, gz = q.z / kGridCell_m;
  // The negated form also sends NaN to the answer "open".
  if (!(gx >= 0 && gy >= 0 && gz >= 0 && gx < grid_size_[0] - 1 && gy < grid_size_[1] - 1 &&
        gz < grid_size_[2] - 1))
    return 1;
  const int ix = static_cast<int>(gx), iy = static_cast<int>(gy), iz = static_cast<int>(gz);
  const auto fx = static_cast<float>(gx - ix), fy = static_cast<float>(gy - iy),
             fz = static_cast<float>(gz - iz);
  const std::ptrdiff_t row = grid_size_[0], slab = row * grid_size_[1];
  const float* d = grid_distance_m_.data() + ix + iy * row + iz * slab;
  const auto along_x = [&](std::ptrdiff_t i) { return d[i] + (d[i + 1] - d[i]) * fx; };
  const float front = along_x(0) + (along_x(row) - along_x(0)) * fy;
  const float back = along_x(slab) + (along_x(slab + row) - along_x(slab)) * fy;
  const float mean_m = front + (back - front) * fz;
  return std::min(std::max(mean_m * static_cast<float>(1 / kOpennessReach_m), 0.0F), 1.0F);
}

Rgb8 surface_color(const Scene& scene, const Primitive& primitive, const Vec3d& p, const Vec3d& n,
                   double footprint_m) {
  const Texture& texture = scene.textures()[scene.finishes()[primitive.finish].texture];
  const double ax = std::fabs(n.x), ay = std::fabs(n.y), az = std::fabs(n.z);
  // Projected along the dominant axis; shifted by the centre so that equal pieces do not look alike.
  const Vec3d q = p + primitive.center_world_m * 0.37;
  if (ay >= ax && ay >= az) return texture.sample(q.x, q.z, footprint_m);
  if (ax >= az) return texture.sample(q.z, -q.y, footprint_m);
  return texture.sample(q.x, -q.y, footprint_m);
}

}  // namespace tactus::hal::synthetic
