#include "pipeline/interact/surroundings.hpp"

#include <algorithm>
#include <cmath>

namespace tactus::interact {
namespace {

constexpr double kFarM = 1e9;
constexpr double kTouchM = 5e-4;  // a ray has arrived
constexpr int kMarchesMax = 16;

/// Signed distance to a shape from a point in its own frame, exact outside.
double distance_to(const contact::Shape& shape, const Vec3d& p) {
  const auto of_corner = [](double x, double y, double z) {
    const Vec3d outside{std::max(x, 0.0), std::max(y, 0.0), std::max(z, 0.0)};
    return outside.norm() + std::min(std::max({x, y, z}), 0.0);
  };
  switch (shape.kind) {
    case contact::ShapeKind::sphere:
      return p.norm() - shape.radius_m;
    case contact::ShapeKind::box:
      return of_corner(std::abs(p.x) - shape.half_extents_m.x, std::abs(p.y) - shape.half_extents_m.y,
                       std::abs(p.z) - shape.half_extents_m.z);
    case contact::ShapeKind::capsule:
      return Vec3d{p.x, p.y, p.z - std::clamp(p.z, -shape.half_length_m, shape.half_length_m)}.norm() -
             shape.radius_m;
    case contact::ShapeKind::cylinder:
      return of_corner(std::sqrt(p.x * p.x + p.y * p.y) - shape.radius_m, -kFarM,
                       std::abs(p.z) - shape.half_length_m);
    case contact::ShapeKind::hull:
      break;
  }
  return kFarM;
}

}  // namespace

void Surroundings::clear(const Vec3d& middle_world_m) noexcept {
  middle_world_m_ = middle_world_m;
  count_ = 0;
}

void Surroundings::add(const contact::BodyState& body) noexcept {
  if (body.velocity_world_m_per_s.dot(body.velocity_world_m_per_s) > kMovingMPerS * kMovingMPerS) return;
  add(body.shape, body.position_world_m, body.q_world_body);
}

void Surroundings::add(const contact::Shape& shape, const Vec3d& center_world_m,
                       const Quaternion& q_world_body) noexcept {
  if (shape.kind == contact::ShapeKind::hull) return;
  const double reach_m = contact::reach_m(shape);
  const double away_m = (center_world_m - middle_world_m_).norm() - reach_m;
  if (!(away_m < kReachM)) return;
  std::size_t at = count_;
  if (count_ == kSolidsMax) {
    const auto farthest = std::max_element(
        solids_.begin(), solids_.end(), [](const Solid& a, const Solid& b) { return a.away_m < b.away_m; });
    if (farthest->away_m <= away_m) return;
    at = static_cast<std::size_t>(farthest - solids_.begin());
  } else {
    ++count_;
  }
  solids_[at] = {shape, center_world_m, Rotation::from(q_world_body), reach_m, away_m};
}

/// kFarM, or less than range_m.
double Surroundings::distance_to_solids(const Vec3d& p, double range_m,
                                        const Solid** nearest) const noexcept {
  double least_m = kFarM;
  for (const Solid& solid : std::span(solids_).first(count_)) {
    const Vec3d off = p - solid.center_world_m;
    const double reach_m = solid.reach_m + range_m;
    if (off.dot(off) > reach_m * reach_m) continue;
    const double d = distance_to(solid.shape, solid.R_world_body.transposed() * off);
    if (d >= std::min(least_m, range_m)) continue;
    least_m = d;
    *nearest = &solid;
  }
  return least_m;
}

bool Surroundings::sample(const Vec3d& p, map::DistanceSample& out) const noexcept {
  const bool is_known = room_.sample(p, out);
  const Solid* solid = nullptr;
  const auto limit_m = static_cast<double>(is_known ? out.distance_m : room_.truncation_m);
  const double d = distance_to_solids(p, limit_m, &solid);
  if (solid == nullptr) return is_known;
  constexpr double h = 1e-4;
  const auto at = [&](const Vec3d& q) {
    return distance_to(solid->shape, solid->R_world_body.transposed() * (q - solid->center_world_m));
  };
  const Vec3d gradient{at(p + Vec3d{h, 0, 0}) - at(p - Vec3d{h, 0, 0}),
                       at(p + Vec3d{0, h, 0}) - at(p - Vec3d{0, h, 0}),
                       at(p + Vec3d{0, 0, h}) - at(p - Vec3d{0, 0, h})};
  out.distance_m = static_cast<float>(std::max(d, -static_cast<double>(room_.truncation_m)));
  out.gradient = gradient.normalized().cast<float>();
  return true;
}

bool Surroundings::raycast(const Vec3d& origin, const Vec3d& direction, double range_m,
                           map::SurfacePoint& out) const noexcept {
  const bool is_hit = room_.raycast(origin, direction, range_m, out);
  if (count_ == 0) return is_hit;
  double left_m = is_hit ? (out.position_world_m.cast<double>() - origin).norm() : range_m;
  Vec3d p = origin;
  for (int i = 0; i < kMarchesMax; ++i) {
    const Solid* solid = nullptr;
    const double d = distance_to_solids(p, left_m, &solid);
    if (solid == nullptr) return is_hit;
    if (d < kTouchM) {
      if (i == 0) return is_hit;  // begins inside: surfaces are met from their front only
      map::DistanceSample touched;
      (void)sample(p, touched);
      out = {};
      out.position_world_m = p.cast<float>();
      out.normal_world = touched.gradient;
      return true;
    }
    p += direction * d;
    left_m -= d;
  }
  return is_hit;
}

contact::DistanceField Surroundings::field() const noexcept {
  contact::DistanceField field;
  field.context = this;
  field.truncation_m = room_.truncation_m;
  field.sample_fn = [](const void* self, const Vec3f& p, map::DistanceSample& out) noexcept {
    return static_cast<const Surroundings*>(self)->sample(p.cast<double>(), out);
  };
  field.materials_fn = [](const void* self, const Vec3f& p, MaterialDistribution& out) noexcept {
    return static_cast<const Surroundings*>(self)->room_.materials(p.cast<double>(), out);
  };
  field.raycast_fn = [](const void* self, const Vec3f& origin, const Vec3f& direction, float range_m,
                        map::SurfacePoint& out) noexcept {
    return static_cast<const Surroundings*>(self)->raycast(origin.cast<double>(), direction.cast<double>(),
                                                           static_cast<double>(range_m), out);
  };
  return field;
}

}  // namespace tactus::interact
