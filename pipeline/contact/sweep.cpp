// The swept test of field_contacts.hpp.
#include <algorithm>
#include <array>
#include <cmath>

#include "pipeline/contact/field_contacts.hpp"
#include "pipeline/contact/field_probe.hpp"
#include "pipeline/contact/sphere_touch.hpp"
#include "pipeline/contact/surface_points.hpp"

namespace tactus::contact {
namespace {

/// What a sweep tests against. Points that touch where it starts are in the solver's hands: they hold a body
/// back only when they sink kSinkM deeper. A slope or a roughness that the body rolls over does not stop it,
/// a wall does.
class Sweep {
 public:
  static constexpr double kTouchM = 0.5 * kContactMarginM;
  /// Or half of a thinner body's thickness: its centre must stay in front of the surface, or nothing holds it any more.
  static constexpr double kSinkM = 0.005;

  Sweep(const DistanceField& field, const Shape& shape, const Vec3d& from, const Rotation& R_world_body,
        const Vec3d& motion)
      : field_(field),
        shape_(shape),
        R_world_body_(R_world_body),
        R_body_world_(R_world_body.transposed()),
        motion_(motion),
        sink_m_(std::min(kSinkM, 0.5 * inner_radius_m(shape))) {
    if (shape.kind == ShapeKind::sphere) {
      touching_count_ = field_contacts(field, shape, from, R_world_body, kContactMarginM, {}, touching_);
      return;
    }
    surface_points(shape, static_cast<double>(field.truncation_m), surface_);
    std::array<float, SurfacePoints::kMax> distances_m;
    surface_distances(field, surface_, from, R_world_body, distances_m);
    for (std::size_t i = 0; i < surface_.count; ++i) {
      Probe probe;
      const bool touches = is_in_band(field, static_cast<double>(distances_m[i]), 1) &&
                           sample_at(from, surface_.points_m[i], kImpactMarginM, probe) &&
                           probe.distance_m < kImpactMarginM;
      allowance_m_[i] = touches ? allowance(probe.distance_m) : 0;
    }
  }

  /// Least distance, allowances added, over the points of the shape that move towards a surface; the
  /// truncation distance when there is none in the band.
  [[nodiscard]] double clearance(const Vec3d& center) const {
    const double truncation_m = static_cast<double>(field_.truncation_m);
    const double least_m =
        shape_.kind == ShapeKind::sphere ? sphere_clearance(center) : points_clearance(center);
    // As field_contacts() has it: what stops here must be a contact there, or the body would hang in the air.
    if (least_m < kTouchM && center_is_behind(field_, center)) return truncation_m;
    return std::min(least_m, truncation_m);
  }

 private:
  [[nodiscard]] double allowance(double distance_m) const { return kTouchM - std::min(distance_m, kTouchM) + sink_m_; }

  [[nodiscard]] double allowance_towards(const Vec3d& direction) const {
    for (int i = 0; i < touching_count_; ++i) {
      const FieldContact& c = touching_[static_cast<std::size_t>(i)];
      if (-c.normal_world.dot(direction) > kSameDirectionCosine)
        return allowance(kContactMarginM - c.depth_m);
    }
    return 0;
  }

  [[nodiscard]] double sphere_clearance(const Vec3d& center) const {
    SphereSeeds seeds;
    const std::size_t count = sample_seeds(field_, center, shape_.radius_m, 1, &motion_, seeds);
    const std::span<SphereSeed> samples = std::span(seeds).first(count);
    for (SphereSeed& seed : samples) seed.touch.distance_m += allowance_towards(seed.touch.direction);
    double least_m = static_cast<double>(field_.truncation_m);
    for (int tries = 0; tries < 3; ++tries) {
      SphereSeed* seed = lowest_unused(samples);
      if (seed == nullptr) break;
      seed->used = true;
      SphereTouch touch = seed->touch;
      if (touch.distance_m > kSeedReach * shape_.radius_m + kContactMarginM) {
        least_m = std::min(least_m, touch.distance_m);
        break;
      }
      touch.distance_m -= allowance_towards(touch.direction);
      descend(field_, center, shape_.radius_m, touch);
      if (touch.gradient.dot(touch.direction) > kFacingCosine || touch.gradient.dot(motion_) > -0.2) continue;
      least_m = std::min(least_m, touch.distance_m + allowance_towards(touch.direction));
    }
    return least_m;
  }

  struct Probe {
    Vec3d arm;
    double distance_m = 0;
    Vec3d gradient;
  };

  /// The field at a point of the surface, turned to the deepest point beside it when that is near; else what
  /// is left when the way there is taken off.
  bool sample_at(const Vec3d& center, const Vec3d& p_body, double near_m, Probe& out) const {
    out.arm = R_world_body_ * p_body;
    if (!sample_band(field_, center + out.arm, 1, out.distance_m, out.gradient)) return false;
    const double sag_m = 2 * surface_.sag_m;
    if (sag_m == 0) return true;
    if (out.distance_m > near_m + 2 * sag_m) {
      out.distance_m -= sag_m;
      return true;
    }
    const Vec3d at = deepest_beside(shape_, p_body, R_body_world_ * -out.gradient);
    Probe deeper{R_world_body_ * at, 0, {}};
    if (at != p_body &&
        sample_band(field_, center + deeper.arm, out.distance_m, deeper.distance_m, deeper.gradient))
      out = deeper;
    return true;
  }

  [[nodiscard]] double points_clearance(const Vec3d& center) const {
    double least_m = static_cast<double>(field_.truncation_m);
    std::array<float, SurfacePoints::kMax> distances_m;
    surface_distances(field_, surface_, center, R_world_body_, distances_m);
    for (std::size_t i = 0; i < surface_.count; ++i) {
      Probe probe;
      if (!is_in_band(field_, static_cast<double>(distances_m[i]), 1)) continue;
      if (!sample_at(center, surface_.points_m[i], kTouchM, probe)) continue;
      if (probe.gradient.dot(probe.arm) > 0 || probe.gradient.dot(motion_) > -0.2) continue;
      least_m = std::min(least_m, probe.distance_m + allowance_m_[i]);
    }
    return least_m;
  }

  const DistanceField& field_;
  const Shape& shape_;
  const Rotation& R_world_body_;
  Rotation R_body_world_;
  Vec3d motion_;
  double sink_m_;
  SurfacePoints surface_;
  std::array<double, SurfacePoints::kMax> allowance_m_;   // of each point of the surface
  std::array<FieldContact, kFieldContactsMax> touching_;  // sphere
  int touching_count_ = 0;
};

}  // namespace

double free_fraction(const DistanceField& field, const Shape& shape, const Vec3d& from,
                     const Rotation& R_world_body, const Vec3d& displacement) noexcept {
  const double length_m = displacement.norm();
  if (length_m <= 0) return 1;
  const Vec3d motion = displacement * (1 / length_m);
  const Sweep sweep(field, shape, from, R_world_body, motion);
  // Half the reported distance is a safe step for surfaces seen at up to 60 degrees (projective distance =
  // 2x).
  constexpr double kSafeStep = 0.5;
  constexpr double kLeastStepM = 0.00025;
  double travelled_m = 0;
  double free_m = 0;  // largest travel that was seen free
  for (int evaluation = 0; evaluation < 128; ++evaluation) {
    const double c = sweep.clearance(from + motion * travelled_m);
    if (c < Sweep::kTouchM) {
      if (travelled_m == 0) return 0;
      double touching_m = travelled_m;
      while (evaluation < 128 && touching_m - free_m > 0.25 * kContactMarginM) {
        const double middle_m = 0.5 * (free_m + touching_m);
        const double m = sweep.clearance(from + motion * middle_m);
        (m < Sweep::kTouchM ? touching_m : free_m) = middle_m;
        ++evaluation;
      }
      return touching_m / length_m;
    }
    free_m = travelled_m;
    if (travelled_m + kSafeStep * c >= length_m) return 1;
    travelled_m = std::min(length_m, travelled_m + std::max(kSafeStep * c, kLeastStepM));
  }
  return free_m / length_m;
}

}  // namespace tactus::contact
