// Where a sphere is nearest to a distance field: seed directions, and the descent from one.
#pragma once

#include <array>
#include <span>

#include "pipeline/contact/directions.hpp"
#include "pipeline/contact/distance_field.hpp"

namespace tactus::contact {

inline constexpr double kSameDirectionCosine = 0.7;  // 45 degrees: closer sphere contacts are one contact
inline constexpr double kFacingCosine = -0.2;        // a sphere's touching point must look at the surface
/// No point of a sphere is farther from a seed than this share of its radius (chord of 36.2 degrees), and the
/// field falls by no more than the way.
inline constexpr double kSeedReach = 0.62;

struct SphereTouch {
  Vec3d direction;  // from the centre to the touching point, unit
  Vec3d gradient;
  double distance_m = 0;
};

struct SphereSeed {
  SphereTouch touch;
  bool used = false;
};
using SphereSeeds = std::array<SphereSeed, kBallDirections.size()>;

/// Descends from touch to the deepest point of the sphere nearby: the minimum of the field on the sphere,
/// where direction = -gradient. On a plane the step to -gradient is exact; on a bump sharper than the sphere
/// it overshoots, so a secant step along the same great circle follows where the slope has not vanished. Step
/// phase; wait-free.
void descend(const DistanceField& field, const Vec3d& center, double radius_m, SphereTouch& touch) noexcept;

/// Samples the seeds that lie in the band, nearer than `nearer_than_m`, and whose surface faces the sphere;
/// with `motion`, only what the sphere moves towards. The number of them. Step phase; wait-free.
std::size_t sample_seeds(const DistanceField& field, const Vec3d& center, double radius_m,
                         double nearer_than_m, const Vec3d* motion, SphereSeeds& out) noexcept;

/// The lowest seed that is not used yet; null when there is none.
SphereSeed* lowest_unused(std::span<SphereSeed> seeds) noexcept;

}  // namespace tactus::contact
