#include "pipeline/sound/room_sound.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "pipeline/sound/impact_sound.hpp"

namespace tactus::sound {
namespace {

constexpr double kLiftM = 0.08;  // twice the map's truncation: outside of what the surface itself occupies
constexpr double kNearestPlaneM = 0.15;
constexpr double kSamePlaneM = 0.12, kSamePlaneCosine = 0.95;
constexpr double kReachedM = 0.15;  // a ray reached a reflection's point when it ends this near
constexpr std::size_t kDirections = 26;

struct Plane {
  Vec3d point_world_m;
  Vec3d normal_world;
  double squareness =
      0;  // cosine between ray and normal: the squarest hit is taken for the plane's direction
};

bool is_same(const Plane& plane, const map::SurfacePoint& hit) {
  const Vec3d normal = hit.normal_world.cast<double>();
  return plane.normal_world.dot(normal) > kSamePlaneCosine &&
         std::abs(plane.normal_world.dot(hit.position_world_m.cast<double>() - plane.point_world_m)) <
             kSamePlaneM;
}

std::array<double, kBands> reflected(const map::SurfacePoint& hit, const contact::MaterialTable& table) {
  std::array<double, kBands> kept{};
  for (std::size_t band = 0; band < kBands; ++band) {
    double absorbed = table.sound_of(kUnknownMaterial).absorption[band];
    if (hit.material != kUnknownMaterial) {
      absorbed = 0;
      for (std::size_t m = 0; m < kMaterialCount; ++m)
        absorbed += static_cast<double>(hit.materials[m]) * table.sound[m].absorption[band];
    }
    kept[band] = std::sqrt(std::clamp(1 - absorbed, 0.0, 1.0));
  }
  return kept;
}

bool reaches(const RoomRays& rays, const Vec3d& from, const Vec3d& point, const Plane& plane,
             map::SurfacePoint& hit) {
  const Vec3d way = point - from;
  return rays.cast(from, way, way.norm() + kReachedM, hit) &&
         (hit.position_world_m.cast<double>() - point).norm() < kReachedM && is_same(plane, hit);
}

struct Planes {
  std::array<Plane, kDirections> planes;
  std::size_t count = 0;

  void cast(const RoomRays& rays, const Vec3d& origin, const Vec3d& direction, double range_m) {
    map::SurfacePoint hit;
    if (!rays.cast(origin, direction, range_m, hit)) return;
    const Plane found{hit.position_world_m.cast<double>(), hit.normal_world.cast<double>(),
                      -direction.dot(hit.normal_world.cast<double>())};
    if (!(found.squareness > 0)) return;
    for (std::size_t i = 0; i < count; ++i) {
      if (!is_same(planes[i], hit)) continue;
      if (found.squareness > planes[i].squareness) planes[i] = found;
      return;
    }
    if (count < planes.size()) planes[count++] = found;
  }
};

// The planes around `origin`: 26 rays along the world's axes and diagonals, then one away from each plane
// they found, which finds the far end of a long room that stands askew to the world.
Planes find_planes(const RoomRays& rays, const Vec3d& origin, double range_m) {
  Planes found;
  for (int x = -1; x <= 1; ++x)
    for (int y = -1; y <= 1; ++y)
      for (int z = -1; z <= 1; ++z)
        if (x != 0 || y != 0 || z != 0)
          found.cast(rays, origin, Vec3d{1.0 * x, 1.0 * y, 1.0 * z}.normalized(), range_m);
  for (std::size_t i = 0, first_round = found.count; i < first_round; ++i)
    found.cast(rays, origin, found.planes[i].normal_world, range_m);
  return found;
}

// A voxel's gradient is 1 to 3 degrees off, which throws an image by 10 cm; three points of the surface, 40
// cm apart and each a millimetre off, are not. Stays as it was where the surface is smaller than that.
Plane squared_up(const RoomRays& rays, const Vec3d& origin, const Plane& plane) {
  constexpr double kProbeM = 0.25;
  const Vec3d& n = plane.normal_world;
  const Vec3d foot = origin - n * n.dot(origin - plane.point_world_m);
  const Vec3d aside = (std::abs(n.y) < 0.7 ? Vec3d{0, 1, 0} : Vec3d{1, 0, 0}).cross(n).normalized();
  const Vec3d other = n.cross(aside);
  const std::array<Vec3d, 3> offsets = {aside, aside * -0.5 + other * 0.866, aside * -0.5 - other * 0.866};
  std::array<Vec3d, 3> at;
  for (std::size_t i = 0; i < 3; ++i) {
    map::SurfacePoint hit;
    const Vec3d way = foot + offsets[i] * kProbeM - origin;
    if (!rays.cast(origin, way, way.norm() + kReachedM, hit) || !is_same(plane, hit)) return plane;
    at[i] = hit.position_world_m.cast<double>();
  }
  const Vec3d normal = (at[1] - at[0]).cross(at[2] - at[0]).normalized();
  if (!(normal.dot(n) > kSamePlaneCosine)) return plane;
  return {(at[0] + at[1] + at[2]) * (1.0 / 3), normal, plane.squareness};
}

// False where source and listener are not both in front of the plane, or the source is as good as on it.
bool mirror(const Plane& plane, const SoundPath& path, Reflection& out) {
  const double source_m = plane.normal_world.dot(path.source_world_m - plane.point_world_m);
  const double listener_m = plane.normal_world.dot(path.listener_world_m - plane.point_world_m);
  if (source_m < kNearestPlaneM || !(listener_m > 0)) return false;
  out.image_world_m = path.source_world_m - plane.normal_world * (2 * source_m);
  const Vec3d way = path.listener_world_m - out.image_world_m;
  out.point_world_m = out.image_world_m + way * (source_m / (source_m + listener_m));
  out.path_m = way.norm();
  return true;
}

}  // namespace

RoomRays rays_of(const map::Reader& reader) {
  return {&reader, [](const void* context, const Vec3f& origin, const Vec3f& direction, float range_m_max,
                      map::SurfacePoint& out) noexcept {
            return static_cast<const map::Reader*>(context)->raycast(origin, direction, range_m_max, out);
          }};
}

int find_reflections(const RoomRays& rays, const contact::MaterialTable& table, const SoundPath& path,
                     double range_m, std::span<Reflection> out) noexcept {
  const Vec3d away = path.source_normal_world == Vec3d{}
                         ? (path.listener_world_m - path.source_world_m).normalized()
                         : path.source_normal_world.normalized();
  const Vec3d origin = path.source_world_m + away * kLiftM;
  const Planes found = find_planes(rays, origin, range_m);

  struct Candidate {
    double path_m;
    std::size_t plane;
  };
  std::array<Candidate, kDirections> candidates{};
  std::size_t count = 0;
  Reflection reflection;
  for (std::size_t i = 0; i < found.count; ++i)
    if (mirror(found.planes[i], path, reflection)) candidates[count++] = {reflection.path_m, i};
  std::sort(candidates.begin(), candidates.begin() + static_cast<std::ptrdiff_t>(count),
            [](const Candidate& a, const Candidate& b) {
              return a.path_m != b.path_m ? a.path_m < b.path_m : a.plane < b.plane;
            });
  // No more planes are looked at than twice the reflections wanted: the number of rays stays bounded.
  std::size_t kept = 0;
  for (std::size_t i = 0; i < std::min(count, 2 * out.size()) && kept < out.size(); ++i) {
    const Plane plane = squared_up(rays, origin, found.planes[candidates[i].plane]);
    map::SurfacePoint hit, seen;
    if (!mirror(plane, path, reflection) || !reaches(rays, origin, reflection.point_world_m, plane, hit) ||
        !reaches(rays, path.listener_world_m, reflection.point_world_m, plane, seen))
      continue;
    reflection.gain = reflected(hit, table);
    out[kept++] = reflection;
  }
  std::sort(out.begin(), out.begin() + static_cast<std::ptrdiff_t>(kept),
            [](const Reflection& a, const Reflection& b) { return a.path_m < b.path_m; });
  return static_cast<int>(kept);
}

void apply_bands(const std::array<double, kBands>& gain, std::span<const float> clip,
                 std::span<float> out) noexcept {
  TACTUS_ASSERT(clip.size() == out.size());
  const auto take = [](double split_hz) {
    return static_cast<float>(1 - std::exp(-2 * std::numbers::pi * split_hz / kSampleRateHz));
  };
  const float take_low = take(500), take_mid = take(2000);
  const auto high = static_cast<float>(gain[2]);
  const auto mid = static_cast<float>(gain[1] - gain[2]), low = static_cast<float>(gain[0] - gain[1]);
  float below_500 = 0, below_2000 = 0;
  for (std::size_t i = 0; i < clip.size(); ++i) {
    below_500 += take_low * (clip[i] - below_500);
    below_2000 += take_mid * (clip[i] - below_2000);
    out[i] = high * clip[i] + mid * below_2000 + low * below_500;
  }
}

}  // namespace tactus::sound
