#include "pipeline/contact/point_contacts.hpp"

#include <algorithm>
#include <cmath>

#include "pipeline/contact/field_probe.hpp"
#include "pipeline/contact/point_memory.hpp"
#include "pipeline/contact/surface_points.hpp"

namespace tactus::contact {
namespace {

constexpr double kSameFaceCosine = 0.9;  // 25 degrees: the edge between floor and wall is a face of its own

/// Picks up to as many of the group as `out` has room for, 4 at most: of the deepest (within 0.1 mm) the one
/// farthest from the group's middle, the one farthest from that, then the farthest on either side of the line
/// between them. Ties go to the lower index, so a box at rest keeps its corners. A body that lies deep in a
/// surface is lifted by its deep points: one that is held by its sides alone would stay there.
int spread(const Candidates& all, std::uint8_t group, std::span<FieldContact> out) {
  double deepest_m = 0;
  for (std::size_t i = 0; i < all.count; ++i)
    if (all.group[i] == group) deepest_m = std::max(deepest_m, all.items[i].depth_m);
  const auto is_member = [&](std::size_t i) {
    return all.group[i] == group && all.items[i].depth_m >= 0.5 * deepest_m - kContactMarginM;
  };
  Vec3d middle;
  double members = 0;
  for (std::size_t i = 0; i < all.count; ++i)
    if (is_member(i)) {
      middle += all.items[i].position_world_m;
      members += 1;
    }
  middle = middle * (1 / members);

  constexpr double kTieM2 = 1e-8;
  constexpr double kApartM2 = 1e-6;  // two points closer than a millimetre hold no better than one
  const auto farthest = [&](auto&& measure) {
    std::size_t best = all.count;
    double best_value = kApartM2;
    for (std::size_t i = 0; i < all.count; ++i) {
      if (!is_member(i)) continue;
      const double value = measure(all.items[i]);
      if (value > best_value + kTieM2 || (best == all.count && value > best_value)) {
        best = i;
        best_value = value;
      }
    }
    return best;
  };
  const auto squared = [](const Vec3d& v) { return v.dot(v); };

  std::array<std::size_t, 4> chosen{};
  std::size_t chosen_count = 0;
  constexpr double kAsDeepM = 0.0001;
  std::size_t a = farthest([&](const FieldContact& c) {
    return c.depth_m >= deepest_m - kAsDeepM ? squared(c.position_world_m - middle) : 0.0;
  });
  if (a == all.count)  // the deepest is the middle
    for (a = 0; !is_member(a) || all.items[a].depth_m < deepest_m;) ++a;
  chosen[chosen_count++] = a;
  const Vec3d pa = all.items[a].position_world_m;
  const std::size_t b = farthest([&](const FieldContact& c) { return squared(c.position_world_m - pa); });
  if (b != all.count) {
    chosen[chosen_count++] = b;
    const Vec3d side = all.items[a].normal_world.cross((all.items[b].position_world_m - pa).normalized());
    const auto offset = [&](const FieldContact& c) { return side.dot(c.position_world_m - pa); };
    const auto signed_square = [](double v) { return v > 0 ? v * v : 0.0; };
    const std::size_t left = farthest([&](const FieldContact& c) { return signed_square(offset(c)); });
    const std::size_t right = farthest([&](const FieldContact& c) { return signed_square(-offset(c)); });
    if (left != all.count) chosen[chosen_count++] = left;
    if (right != all.count) chosen[chosen_count++] = right;
  }
  std::size_t written = 0;
  for (std::size_t i = 0; i < chosen_count && written < out.size(); ++i)
    out[written++] = all.items[chosen[i]];
  return static_cast<int>(written);
}

}  // namespace

void collect(const DistanceField& field, const Shape& shape, const Vec3d& center,
             const Rotation& R_world_body, double spacing_m, double margin_m, Candidates& candidates,
             PointMemory* memory) noexcept {
  SurfacePoints surface;
  surface_points(shape, spacing_m, surface);
  std::array<float, SurfacePoints::kMax> distances_m;
  // Projective distances fall by up to twice the way.
  const double near_m = margin_m + 2 * surface.sag_m;
  if (memory != nullptr)
    remembered_distances(field, surface, reach_m(shape), center, R_world_body, near_m, *memory, distances_m);
  else
    surface_distances(field, surface, center, R_world_body, distances_m);
  const Rotation R_body_world = R_world_body.transposed();
  for (std::size_t i = 0; i < surface.count; ++i) {
    if (!is_in_band(field, static_cast<double>(distances_m[i]), near_m)) continue;
    const Vec3d& p_body = surface.points_m[i];
    Vec3d arm = R_world_body * p_body;
    double distance_m = 0;
    Vec3d gradient;
    if (!sample_band(field, center + arm, near_m, distance_m, gradient)) continue;
    if (surface.sag_m > 0) {
      const Vec3d at = deepest_beside(shape, p_body, R_body_world * -gradient);
      const Vec3d arm_there = R_world_body * at;
      double deeper_m = 0;
      Vec3d deeper_gradient;
      if (at != p_body && sample_band(field, center + arm_there, distance_m, deeper_m, deeper_gradient)) {
        arm = arm_there;
        distance_m = deeper_m;
        gradient = deeper_gradient;
      }
    }
    if (distance_m >= margin_m || gradient.dot(arm) > 0) continue;
    if (candidates.count == Candidates::kMax) return;
    candidates.touches = candidates.touches || distance_m < kContactMarginM;
    candidates.items[candidates.count++] = {center + arm, gradient.normalized(),
                                            std::max(0.0, kContactMarginM - distance_m)};
  }
}

int reduce(Candidates& candidates, const Vec3d& up, std::span<FieldContact, kFieldContactsMax> out) noexcept {
  if (!candidates.touches) return 0;
  std::array<Vec3d, 3> normals;
  std::size_t groups = 0;
  for (std::size_t i = 0; i < candidates.count; ++i) {
    std::size_t g = 0;
    while (g < groups && normals[g].dot(candidates.items[i].normal_world) < kSameFaceCosine) ++g;
    if (g == groups && groups < normals.size()) normals[groups++] = candidates.items[i].normal_world;
    candidates.group[i] = static_cast<std::uint8_t>(std::min(g, groups - 1));
  }
  std::size_t carrying = 0;
  for (std::size_t g = 1; g < groups; ++g)
    if (normals[g].dot(up) > normals[carrying].dot(up)) carrying = g;
  std::size_t count = 0;
  for (std::size_t g = 0; g < groups; ++g) {
    const std::size_t room = groups < 3 || g == carrying ? 4 : 2;
    count += static_cast<std::size_t>(
        spread(candidates, static_cast<std::uint8_t>(g), std::span<FieldContact>(out).subspan(count, room)));
  }
  return static_cast<int>(count);
}

}  // namespace tactus::contact
