#include "pipeline/contact/field_contacts.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace tactus::contact {
namespace {

constexpr double kInvSqrt2 = 0.70710678118654752440;
constexpr double kInvSqrt3 = 0.57735026918962576451;

/// Axes, corners, edge midpoints. No direction is farther from a seed than 36.2 degrees with the first
/// 14, 27.4 with all.
constexpr std::array<Vec3d, 26> kSeeds = {{
    {1, 0, 0},
    {-1, 0, 0},
    {0, 1, 0},
    {0, -1, 0},
    {0, 0, 1},
    {0, 0, -1},
    {kInvSqrt3, kInvSqrt3, kInvSqrt3},
    {-kInvSqrt3, kInvSqrt3, kInvSqrt3},
    {kInvSqrt3, -kInvSqrt3, kInvSqrt3},
    {-kInvSqrt3, -kInvSqrt3, kInvSqrt3},
    {kInvSqrt3, kInvSqrt3, -kInvSqrt3},
    {-kInvSqrt3, kInvSqrt3, -kInvSqrt3},
    {kInvSqrt3, -kInvSqrt3, -kInvSqrt3},
    {-kInvSqrt3, -kInvSqrt3, -kInvSqrt3},
    {kInvSqrt2, kInvSqrt2, 0},
    {-kInvSqrt2, kInvSqrt2, 0},
    {kInvSqrt2, -kInvSqrt2, 0},
    {-kInvSqrt2, -kInvSqrt2, 0},
    {kInvSqrt2, 0, kInvSqrt2},
    {-kInvSqrt2, 0, kInvSqrt2},
    {kInvSqrt2, 0, -kInvSqrt2},
    {-kInvSqrt2, 0, -kInvSqrt2},
    {0, kInvSqrt2, kInvSqrt2},
    {0, -kInvSqrt2, kInvSqrt2},
    {0, kInvSqrt2, -kInvSqrt2},
    {0, -kInvSqrt2, -kInvSqrt2},
}};
constexpr int kSeedsFew = 14;
constexpr int kSphereContactsMax = 4;
constexpr double kSameDirectionCosine = 0.7;  // 45 degrees: closer sphere contacts are one contact
constexpr double kFacingCosine = -0.2;        // a sphere's touching point must look at the surface
constexpr double kSameFaceCosine = 0.9;  // 25 degrees: the edge between floor and wall is a face of its own

/// A sample that may carry a contact: observed, inside the truncation band, with a direction.
bool sample_band(const DistanceField& field, const Vec3d& p, double& distance_m, Vec3d& gradient) {
  map::DistanceSample s;
  if (!field.sample(p, s)) return false;
  distance_m = static_cast<double>(s.distance_m);
  const double band_m = 0.95 * static_cast<double>(field.truncation_m);
  if (distance_m <= -band_m || distance_m >= band_m) return false;
  gradient = s.gradient.cast<double>();
  return gradient.dot(gradient) > 0.25;
}

/// True when the shape's centre is known to lie behind a surface.
bool center_is_behind(const DistanceField& field, const Vec3d& center) {
  map::DistanceSample s;
  return field.sample(center, s) && s.distance_m < 0;
}

struct SphereTouch {
  Vec3d direction;  // from the centre to the touching point, unit
  Vec3d gradient;
  double distance_m = 0;
};

/// Descends from touch to the deepest point of the sphere nearby: the minimum of the field on the sphere,
/// where direction = -gradient. On a plane the step to -gradient is exact; on a bump sharper than the sphere
/// it overshoots, so a secant step along the same great circle follows where the slope has not vanished.
void descend(const DistanceField& field, const Vec3d& center, double radius_m, SphereTouch& touch) {
  const auto try_at = [&](const Vec3d& direction, SphereTouch& best) {
    SphereTouch next{direction, {}, 0};
    if (!sample_band(field, center + direction * radius_m, next.distance_m, next.gradient)) return Vec3d{};
    if (next.distance_m < best.distance_m) best = next;
    return next.gradient;
  };
  for (int iteration = 0; iteration < 4; ++iteration) {
    const Vec3d from = touch.direction;
    const double cosine = -touch.gradient.dot(from);
    const Vec3d across = -touch.gradient - from * cosine;
    const double sine = across.norm();
    if (sine < 0.003) return;  // the height left is 5e-6 of the radius
    const Vec3d tangent = across * (1 / sine);
    double tau = cosine > 0.5 ? sine / cosine : 1.5;
    double low = 0, slope_low = -sine, high = 0, slope_high = 0;

    SphereTouch best = touch;
    for (int attempt = 0; attempt < 4; ++attempt) {
      const Vec3d direction = (from + tangent * tau).normalized();
      const Vec3d gradient = try_at(direction, best);
      // A step out of the band has climbed.
      const double slope = gradient == Vec3d{}
                               ? sine
                               : gradient.dot((tangent - direction * tangent.dot(direction)).normalized());
      if (std::abs(slope) < 0.03) break;
      (slope > 0 ? high : low) = tau;
      (slope > 0 ? slope_high : slope_low) = slope;
      if (high == 0) break;  // still falling: the next round turns towards the new gradient
      tau = (low * slope_high - high * slope_low) / (slope_high - slope_low);
    }
    if (best.distance_m >= touch.distance_m) return;
    touch = best;
  }
}

struct SeedSample {
  SphereTouch touch;
  bool used = false;
};

/// Samples the seeds that lie in the band and whose surface faces the sphere; with `motion`, only what the
/// sphere moves towards.
int sample_seeds(const DistanceField& field, const Vec3d& center, double radius_m, const Vec3d* motion,
                 std::array<SeedSample, kSeeds.size()>& out) {
  const std::size_t seeds_count =
      radius_m > 0.5 * static_cast<double>(field.truncation_m) ? kSeeds.size() : std::size_t{kSeedsFew};
  int count = 0;
  for (std::size_t i = 0; i < seeds_count; ++i) {
    SphereTouch touch{kSeeds[i], {}, 0};
    if (motion != nullptr && touch.direction.dot(*motion) < -0.3) continue;
    if (!sample_band(field, center + touch.direction * radius_m, touch.distance_m, touch.gradient)) continue;
    if (touch.gradient.dot(touch.direction) > 0) continue;
    if (motion != nullptr && touch.gradient.dot(*motion) > -0.2) continue;
    out[static_cast<std::size_t>(count++)] = {touch, false};
  }
  return count;
}

int lowest_unused(std::span<const SeedSample> seeds) {
  int best = -1;
  for (std::size_t i = 0; i < seeds.size(); ++i)
    if (!seeds[i].used &&
        (best < 0 || seeds[i].touch.distance_m < seeds[static_cast<std::size_t>(best)].touch.distance_m))
      best = static_cast<int>(i);
  return best;
}

struct BoxLattice {
  std::array<int, 3> points{};  // along each edge
  Vec3d half;

  BoxLattice(const Vec3d& half_extents_m, double spacing_m) : half(half_extents_m) {
    const double edges[3] = {2 * half.x, 2 * half.y, 2 * half.z};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      int n = 2;
      while (n < 5 && edges[axis] > spacing_m * (n - 1)) ++n;
      points[axis] = n;
    }
  }

  template <typename Visit>
  void for_each_surface_point(Visit&& visit) const {
    for (int i = 0; i < points[0]; ++i)
      for (int j = 0; j < points[1]; ++j)
        for (int k = 0; k < points[2]; ++k) {
          const bool on_surface =
              i == 0 || j == 0 || k == 0 || i == points[0] - 1 || j == points[1] - 1 || k == points[2] - 1;
          if (!on_surface) continue;
          visit(Vec3d{half.x * (2.0 * i / (points[0] - 1) - 1), half.y * (2.0 * j / (points[1] - 1) - 1),
                      half.z * (2.0 * k / (points[2] - 1) - 1)});
        }
  }
};
constexpr std::size_t kLatticePointsMax = 98;  // 5^3 - 3^3

struct Candidates {
  std::array<FieldContact, kLatticePointsMax> items;
  std::array<std::uint8_t, kLatticePointsMax> group{};
  std::size_t count = 0;
};

/// Picks up to 4 of the group: the one farthest from the group's middle, the one farthest from that, then the
/// farthest on either side of the line between them. Ties go to the lower lattice index, so a box at rest
/// keeps its corners.
int spread(const Candidates& all, std::uint8_t group, std::span<FieldContact> out) {
  Vec3d middle;
  double members = 0;
  for (std::size_t i = 0; i < all.count; ++i)
    if (all.group[i] == group) {
      middle += all.items[i].position_world_m;
      members += 1;
    }
  middle = middle * (1 / members);

  constexpr double kTieM2 = 1e-8;
  const auto farthest = [&](auto&& measure) {
    std::size_t best = all.count;
    double best_value = 1e-12;
    for (std::size_t i = 0; i < all.count; ++i) {
      if (all.group[i] != group) continue;
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
  std::size_t a = farthest([&](const FieldContact& c) { return squared(c.position_world_m - middle); });
  if (a == all.count)  // one member: the middle is the point
    for (a = 0; all.group[a] != group;) ++a;
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

int sphere_contacts(const DistanceField& field, const Vec3d& center, double radius_m,
                    std::span<FieldContact, kFieldContactsMax> out) noexcept {
  std::array<SeedSample, kSeeds.size()> seeds;
  const int seeds_count = sample_seeds(field, center, radius_m, nullptr, seeds);
  if (seeds_count == 0) return 0;
  const std::span<SeedSample> samples = std::span(seeds).first(static_cast<std::size_t>(seeds_count));

  std::array<Vec3d, 6> visited;
  std::size_t visited_count = 0;
  int count = 0;
  while (count < kSphereContactsMax && visited_count < visited.size()) {
    const int lowest = lowest_unused(samples);
    if (lowest < 0) break;
    SeedSample& seed = samples[static_cast<std::size_t>(lowest)];
    seed.used = true;
    // A point lower than the margin is at most 0.62 radii (chord of 36.2 degrees) from some seed, and the
    // field falls by no more than the way.
    if (seed.touch.distance_m > 0.62 * radius_m + kContactMarginM) break;
    const auto same = [&](const Vec3d& direction) {
      for (std::size_t i = 0; i < visited_count; ++i)
        if (visited[i].dot(direction) > kSameDirectionCosine) return true;
      return false;
    };
    if (same(seed.touch.direction)) continue;
    SphereTouch touch = seed.touch;
    descend(field, center, radius_m, touch);
    if (same(touch.direction)) continue;
    visited[visited_count++] = touch.direction;
    if (touch.distance_m >= kContactMarginM || touch.gradient.dot(touch.direction) > kFacingCosine) continue;
    if (count == 0 && center_is_behind(field, center)) return 0;
    out[static_cast<std::size_t>(count++)] = {
        center + touch.direction * radius_m, touch.gradient.normalized(), kContactMarginM - touch.distance_m};
  }
  return count;
}

int box_contacts(const DistanceField& field, const Vec3d& center, const Rotation& R_world_body,
                 const Vec3d& half_extents_m, double margin_m,
                 std::span<FieldContact, kFieldContactsMax> out) noexcept {
  Candidates candidates;
  bool touches = false;
  const BoxLattice lattice(half_extents_m, static_cast<double>(field.truncation_m));
  lattice.for_each_surface_point([&](const Vec3d& p_body) {
    const Vec3d arm = R_world_body * p_body;
    double distance_m = 0;
    Vec3d gradient;
    if (!sample_band(field, center + arm, distance_m, gradient)) return;
    if (distance_m >= margin_m || gradient.dot(arm) > 0) return;
    touches = touches || distance_m < kContactMarginM;
    candidates.items[candidates.count++] = {center + arm, gradient.normalized(),
                                            std::max(0.0, kContactMarginM - distance_m)};
  });
  if (!touches || center_is_behind(field, center)) return 0;

  // Groups by normal, seeded by the first member in lattice order: three are enough for a box in a corner;
  // what else there is joins the last.
  std::array<Vec3d, 3> normals;
  std::size_t groups = 0;
  for (std::size_t i = 0; i < candidates.count; ++i) {
    std::size_t g = 0;
    while (g < groups && normals[g].dot(candidates.items[i].normal_world) < kSameFaceCosine) ++g;
    if (g == groups && groups < normals.size()) normals[groups++] = candidates.items[i].normal_world;
    candidates.group[i] = static_cast<std::uint8_t>(std::min(g, groups - 1));
  }
  std::size_t count = 0;
  for (std::size_t g = 0; g < groups; ++g)
    count += static_cast<std::size_t>(
        spread(candidates, static_cast<std::uint8_t>(g), std::span<FieldContact>(out).subspan(count)));
  return static_cast<int>(count);
}

namespace {

/// What a sweep tests against. Points that touch where it starts are in the solver's hands: they hold a body
/// back only when they sink kSinkM deeper. A slope or a roughness that the body rolls over does not stop it,
/// a wall does.
class Sweep {
 public:
  static constexpr double kTouchM = 0.5 * kContactMarginM;
  static constexpr double kSinkM = 0.005;

  Sweep(const DistanceField& field, const Shape& shape, const Vec3d& from, const Rotation& R_world_body,
        const Vec3d& motion)
      : field_(field),
        shape_(shape),
        R_world_body_(R_world_body),
        motion_(motion),
        lattice_(shape.half_extents_m, static_cast<double>(field.truncation_m)) {
    if (shape.kind == ShapeKind::sphere) {
      touching_count_ = sphere_contacts(field, from, shape.radius_m, touching_);
      return;
    }
    std::size_t index = 0;
    lattice_.for_each_surface_point([&](const Vec3d& p_body) {
      double distance_m = 0;
      Vec3d gradient;
      const bool touches = sample_band(field, from + R_world_body * p_body, distance_m, gradient) &&
                           distance_m < kImpactMarginM;
      allowance_m_[index++] = touches ? allowance(distance_m) : 0;
    });
  }

  /// Least distance, allowances added, over the points of the shape that move towards a surface; the
  /// truncation distance when there is none in the band.
  [[nodiscard]] double clearance(const Vec3d& center) const {
    const double truncation_m = static_cast<double>(field_.truncation_m);
    bool inside = false;
    const double least_m =
        shape_.kind == ShapeKind::sphere ? sphere_clearance(center, inside) : box_clearance(center, inside);
    if (inside && center_is_behind(field_, center)) return truncation_m;
    return std::min(least_m, truncation_m);
  }

 private:
  static double allowance(double distance_m) { return kTouchM - std::min(distance_m, kTouchM) + kSinkM; }

  [[nodiscard]] double allowance_towards(const Vec3d& direction) const {
    for (int i = 0; i < touching_count_; ++i) {
      const FieldContact& c = touching_[static_cast<std::size_t>(i)];
      if (-c.normal_world.dot(direction) > kSameDirectionCosine)
        return allowance(kContactMarginM - c.depth_m);
    }
    return 0;
  }

  [[nodiscard]] double sphere_clearance(const Vec3d& center, bool& inside) const {
    std::array<SeedSample, kSeeds.size()> seeds;
    const int count = sample_seeds(field_, center, shape_.radius_m, &motion_, seeds);
    const std::span<SeedSample> samples = std::span(seeds).first(static_cast<std::size_t>(count));
    for (SeedSample& seed : samples) seed.touch.distance_m += allowance_towards(seed.touch.direction);
    double least_m = static_cast<double>(field_.truncation_m);
    for (int tries = 0; tries < 3; ++tries) {
      const int lowest = lowest_unused(samples);
      if (lowest < 0) break;
      SeedSample& seed = samples[static_cast<std::size_t>(lowest)];
      seed.used = true;
      SphereTouch touch = seed.touch;
      if (touch.distance_m > 0.62 * shape_.radius_m + kContactMarginM) {
        least_m = std::min(least_m, touch.distance_m);
        break;
      }
      touch.distance_m -= allowance_towards(touch.direction);
      descend(field_, center, shape_.radius_m, touch);
      if (touch.gradient.dot(touch.direction) > kFacingCosine || touch.gradient.dot(motion_) > -0.2) continue;
      inside = inside || touch.distance_m < 0;
      least_m = std::min(least_m, touch.distance_m + allowance_towards(touch.direction));
    }
    return least_m;
  }

  [[nodiscard]] double box_clearance(const Vec3d& center, bool& inside) const {
    double least_m = static_cast<double>(field_.truncation_m);
    std::size_t index = 0;
    lattice_.for_each_surface_point([&](const Vec3d& p_body) {
      const double allowance_m = allowance_m_[index++];
      const Vec3d arm = R_world_body_ * p_body;
      double distance_m = 0;
      Vec3d gradient;
      if (!sample_band(field_, center + arm, distance_m, gradient)) return;
      if (gradient.dot(arm) > 0 || gradient.dot(motion_) > -0.2) return;
      inside = inside || distance_m < 0;
      least_m = std::min(least_m, distance_m + allowance_m);
    });
    return least_m;
  }

  const DistanceField& field_;
  const Shape& shape_;
  const Rotation& R_world_body_;
  Vec3d motion_;
  BoxLattice lattice_;
  std::array<double, kLatticePointsMax> allowance_m_;     // box: of each lattice point
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
