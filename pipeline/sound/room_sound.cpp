#include "pipeline/sound/room_sound.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "pipeline/sound/impact_sound.hpp"

namespace tactus::sound {
namespace {

constexpr double kLiftM = 0.08;  // twice the map's truncation: outside of what the surface itself occupies
constexpr double kNearestPlaneM = 0.15;
constexpr double kFitM = 0.25;   // a plane is one that is flat over this radius
constexpr double kFlatM = 0.03;  // to this; walls 4 m away are mapped with a centimetre of noise
constexpr double kGoodFitM = 0.001;
constexpr double kSamePlaneCosine = 0.95;
constexpr double kOnPlaneM = 0.08;  // a picture on its wall belongs to the wall
constexpr double kReachedM = 0.15;  // a ray reached a reflection's point when it ends this near
constexpr double kOneImageM = 0.5;  // images nearer than this are of one wall, found twice
constexpr std::size_t kPlanesMax = 32;

struct Plane {
  Vec3d point_world_m;
  Vec3d normal_world;     // towards where it was seen from
  double residual_m = 0;  // of the fit
  int refits_left = 3;

  [[nodiscard]] double distance_m(const Vec3d& p_world_m) const {
    return normal_world.dot(p_world_m - point_world_m);
  }
};

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

/// How far a straight way to a point of a plane goes.
enum class Way { reaches_it, blocked, unknown };

Way way_to(const contact::DistanceField& room, const Vec3d& from, const Vec3d& point, const Plane& plane,
           map::SurfacePoint& hit) {
  const Vec3d way = point - from;
  if (!room.raycast(from, way, way.norm() + kReachedM, hit)) return Way::unknown;
  const Vec3d end = hit.position_world_m.cast<double>();
  const bool is_there = (end - point).norm() < kReachedM && std::abs(plane.distance_m(end)) < kOnPlaneM;
  return is_there ? Way::reaches_it : Way::blocked;
}

// What is left of the three bands behind an obstacle: 10 log10(3 + 20 N) dB less, N = 2 * detour / wavelength
// (Maekawa 1968, "Noise reduction by screens"), for a detour of 5 cm.
constexpr std::array<double, kBands> kBehindObstacle = {0.474, 0.336, 0.195};

// The surface must be seen from source or listener; the other may have to hear round something. False where
// neither sees it, or where nobody knows what is between.
bool connect(const contact::DistanceField& room, const contact::MaterialTable& table, const Vec3d& origin,
             const Vec3d& listener, const Plane& plane, Reflection& reflection) {
  map::SurfacePoint from_source, from_listener;
  const Way there = way_to(room, origin, reflection.point_world_m, plane, from_source);
  if (there == Way::unknown) return false;
  const Way back = way_to(room, listener, reflection.point_world_m, plane, from_listener);
  if (back == Way::unknown || (there == Way::blocked && back == Way::blocked)) return false;
  reflection.gain = reflected(there == Way::reaches_it ? from_source : from_listener, table);
  if (there == Way::blocked || back == Way::blocked)
    for (std::size_t band = 0; band < kBands; ++band) reflection.gain[band] *= kBehindObstacle[band];
  return true;
}

// The plane through what three rays beside this one hit; false where that is not flat. Gradients of a map's
// far walls are up to 40 degrees off; four points half a metre apart and a centimetre off are not.
bool fit_plane(const contact::DistanceField& room, const Vec3d& origin, const Vec3d& direction, const Vec3d& hit_world_m,
               Plane& out) {
  const Vec3d aside =
      (std::abs(direction.y) < 0.7 ? Vec3d{0, 1, 0} : Vec3d{1, 0, 0}).cross(direction).normalized();
  const Vec3d other = direction.cross(aside);
  const std::array<Vec3d, 3> offsets = {aside, aside * -0.5 + other * 0.866, aside * -0.5 - other * 0.866};
  std::array<Vec3d, 3> at;
  for (std::size_t i = 0; i < 3; ++i) {
    map::SurfacePoint hit;
    const Vec3d way = hit_world_m + offsets[i] * kFitM - origin;
    if (!room.raycast(origin, way, 2 * way.norm(), hit)) return false;
    at[i] = hit.position_world_m.cast<double>();
    if ((at[i] - hit_world_m).norm() > 4 * kFitM) return false;
  }
  out.normal_world = (at[1] - at[0]).cross(at[2] - at[0]).normalized();
  if (out.normal_world.dot(direction) > 0) out.normal_world = -out.normal_world;
  out.point_world_m = (at[0] + at[1] + at[2]) * (1.0 / 3);
  out.residual_m = std::abs(out.distance_m(hit_world_m));
  return out.normal_world.dot(direction) < -0.1 && out.residual_m < kFlatM;
}

struct Planes {
  std::array<Plane, kPlanesMax> planes;
  std::size_t count = 0;

  void cast(const contact::DistanceField& room, const Vec3d& origin, const Vec3d& direction, double range_m) {
    map::SurfacePoint hit;
    if (count == planes.size() || !room.raycast(origin, direction, range_m, hit)) return;
    const Vec3d end = hit.position_world_m.cast<double>();
    Plane fitted;
    for (std::size_t i = 0; i < count; ++i) {
      Plane& known = planes[i];
      if (std::abs(known.distance_m(end)) > kFlatM || known.normal_world.dot(direction) > 0) continue;
      // A fit that took in a corner leaves a residual: the best of a few is kept.
      if (known.residual_m > kGoodFitM && known.refits_left-- > 0 &&
          fit_plane(room, origin, direction, end, fitted) && fitted.residual_m < known.residual_m &&
          fitted.normal_world.dot(known.normal_world) > kSamePlaneCosine) {
        fitted.refits_left = known.refits_left;
        known = fitted;
      }
      return;
    }
    if (fit_plane(room, origin, direction, end, fitted)) planes[count++] = fitted;
  }
};

// The planes around source and listener: 26 rays from each along the world's axes and diagonals, then one
// away from each plane they found, which finds the far end of a long room that stands askew to the world. A
// source is often among things that hide the walls from it, but for the one way to the reflection's point.
Planes find_planes(const contact::DistanceField& room, const Vec3d& source, const Vec3d& listener, double range_m) {
  Planes found;
  for (const Vec3d& origin : {source, listener})
    for (int x = -1; x <= 1; ++x)
      for (int y = -1; y <= 1; ++y)
        for (int z = -1; z <= 1; ++z)
          if (x != 0 || y != 0 || z != 0)
            found.cast(room, origin, Vec3d{1.0 * x, 1.0 * y, 1.0 * z}.normalized(), range_m);
  for (std::size_t i = 0, first_round = found.count; i < first_round; ++i)
    found.cast(room, source, found.planes[i].normal_world, range_m);
  return found;
}

// False where source and listener are not both in front of the plane, or the source is as good as on it.
bool mirror(const Plane& plane, const SoundPath& path, Reflection& out) {
  const double source_m = plane.distance_m(path.source_world_m);
  const double listener_m = plane.distance_m(path.listener_world_m);
  if (source_m < kNearestPlaneM || !(listener_m > 0)) return false;
  out.image_world_m = path.source_world_m - plane.normal_world * (2 * source_m);
  const Vec3d way = path.listener_world_m - out.image_world_m;
  out.point_world_m = out.image_world_m + way * (source_m / (source_m + listener_m));
  out.path_m = way.norm();
  return true;
}

}  // namespace

int find_reflections(const contact::DistanceField& room, const contact::MaterialTable& table, const SoundPath& path,
                     double range_m, std::span<Reflection> out) noexcept {
  const Vec3d away = path.source_normal_world == Vec3d{}
                         ? (path.listener_world_m - path.source_world_m).normalized()
                         : path.source_normal_world.normalized();
  const Vec3d origin = path.source_world_m + away * kLiftM;
  const Planes found = find_planes(room, origin, path.listener_world_m, range_m);

  struct Candidate {
    double path_m;
    std::size_t plane;
  };
  std::array<Candidate, kPlanesMax> candidates{};
  std::size_t count = 0;
  Reflection reflection;
  for (std::size_t i = 0; i < found.count; ++i)
    if (mirror(found.planes[i], path, reflection)) candidates[count++] = {reflection.path_m, i};
  std::sort(candidates.begin(), candidates.begin() + static_cast<std::ptrdiff_t>(count),
            [](const Candidate& a, const Candidate& b) {
              return a.path_m != b.path_m ? a.path_m < b.path_m : a.plane < b.plane;
            });
  std::size_t kept = 0;
  for (std::size_t i = 0; i < count && kept < out.size(); ++i) {
    Plane plane = found.planes[candidates[i].plane];
    if (!mirror(plane, path, reflection)) continue;
    // Once more where it counts, so that the image does not stand on a plane extended over metres.
    Plane fitted;
    if (plane.residual_m > kGoodFitM &&
        fit_plane(room, origin, (reflection.point_world_m - origin).normalized(), reflection.point_world_m,
                  fitted) &&
        fitted.residual_m < plane.residual_m &&
        fitted.normal_world.dot(plane.normal_world) > kSamePlaneCosine)
      plane = fitted;
    if (!mirror(plane, path, reflection) ||
        std::any_of(out.begin(), out.begin() + static_cast<std::ptrdiff_t>(kept),
                    [&reflection](const Reflection& other) {
                      return (other.image_world_m - reflection.image_world_m).norm() < kOneImageM;
                    }) ||
        !connect(room, table, origin, path.listener_world_m, plane, reflection))
      continue;
    out[kept++] = reflection;
  }
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
