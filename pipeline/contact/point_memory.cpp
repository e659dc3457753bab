#include "pipeline/contact/point_memory.hpp"

#include <algorithm>
#include <cmath>

namespace tactus::contact {
namespace {

/// No point within `reach_m` of the centre has moved farther (Frobenius' norm bounds that of the rotation).
double moved_m(const PointMemory& memory, double reach_m, const Vec3d& center, const Rotation& R_world_body) {
  double turned2 = 0;
  for (std::size_t i = 0; i < 9; ++i) {
    const double d = R_world_body.m[i] - memory.R_world_body.m[i];
    turned2 += d * d;
  }
  return (center - memory.center_world_m).norm() + std::sqrt(turned2) * reach_m;
}

}  // namespace

void remembered_distances(const DistanceField& field, const SurfacePoints& surface, double reach_m,
                          const Vec3d& center, const Rotation& R_world_body, double nearer_than_m,
                          PointMemory& memory, std::span<float, SurfacePoints::kMax> distances_m) noexcept {
  const bool is_its_turn = memory.turn++ % PointMemory::kSteps == 0;
  if (!is_its_turn && memory.count == surface.count) {
    const double far_m =
        nearer_than_m + static_cast<double>(field.slope_max) * moved_m(memory, reach_m, center, R_world_body);
    std::array<Vec3f, SurfacePoints::kMax> points;
    std::array<std::uint8_t, SurfacePoints::kMax> which;
    std::size_t count = 0;
    for (std::size_t i = 0; i < surface.count; ++i) {
      const float was_m = memory.distances_m[i];
      distances_m[i] = was_m;
      if (static_cast<double>(was_m) >= far_m && was_m != map::kUnknownDistanceM) continue;
      which[count] = static_cast<std::uint8_t>(i);
      points[count++] = (center + R_world_body * surface.points_m[i]).cast<float>();
    }
    // Else most of them have come near enough to matter, and the memory is too old to be of use.
    if (2 * count < surface.count) {
      std::array<float, SurfacePoints::kMax> asked_m;
      field.distances(std::span(points).first(count), asked_m);
      for (std::size_t i = 0; i < count; ++i) distances_m[which[i]] = asked_m[i];
      return;
    }
  }
  surface_distances(field, surface, center, R_world_body, distances_m);
  std::copy_n(distances_m.begin(), surface.count, memory.distances_m.begin());
  memory.count = surface.count;
  memory.center_world_m = center;
  memory.R_world_body = R_world_body;
}

}  // namespace tactus::contact
