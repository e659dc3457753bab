#include "hal/synthetic/scene.hpp"

#include <cmath>
#include <utility>

#include "hal/synthetic/rooms.hpp"
#include "hal/synthetic/shade.hpp"
#include "rt/assert.hpp"

namespace tactus::hal::synthetic {
namespace {
constexpr double kGridCell_m = 0.1;
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
  const auto cells = [](double length_m) { return static_cast<int>(length_m / kGridCell_m) + 2; };
  grid_.origin_m = parts_.room_min_m.cast<float>();
  grid_.cell_m = static_cast<float>(kGridCell_m);
  grid_.size = {cells(extent.x), cells(extent.y), cells(extent.z)};
  for (int z = 0; z < grid_.size[2]; ++z)
    for (int y = 0; y < grid_.size[1]; ++y)
      for (int x = 0; x < grid_.size[0]; ++x)
        grid_.distance_m.push_back(static_cast<float>(
            distance(parts_.room_min_m + Vec3d{x * kGridCell_m, y * kGridCell_m, z * kGridCell_m})));
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
  return sample_along(parts_.textures[parts_.finishes[s.finish].texture],
                      texture_point(s, p_local.cast<float>()),
                      dominant_axis(local_normal(s, p_local).cast<float>()), 0);
}

}  // namespace tactus::hal::synthetic
