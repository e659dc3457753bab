#include "pipeline/contact/sphere_touch.hpp"

#include <cmath>

#include "pipeline/contact/field_probe.hpp"

namespace tactus::contact {

void descend(const DistanceField& field, const Vec3d& center, double radius_m, SphereTouch& touch) noexcept {
  const auto try_at = [&](const Vec3d& direction, SphereTouch& best) {
    SphereTouch next{direction, {}, 0};
    if (!sample_band(field, center + direction * radius_m, 1, next.distance_m, next.gradient)) return Vec3d{};
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

std::size_t sample_seeds(const DistanceField& field, const Vec3d& center, double radius_m,
                         double nearer_than_m, const Vec3d* motion, SphereSeeds& out) noexcept {
  const std::size_t seeds_count =
      radius_m > 0.5 * static_cast<double>(field.truncation_m) ? kBallDirections.size() : kBallDirectionsFew;
  std::array<Vec3f, kBallDirections.size()> points;
  for (std::size_t i = 0; i < seeds_count; ++i)
    points[i] = (center + kBallDirections[i] * radius_m).cast<float>();
  std::array<float, kBallDirections.size()> distances_m;
  field.distances(std::span(points).first(seeds_count), distances_m);
  std::size_t count = 0;
  for (std::size_t i = 0; i < seeds_count; ++i) {
    SphereTouch touch{kBallDirections[i], {}, 0};
    if (!is_in_band(field, static_cast<double>(distances_m[i]), nearer_than_m)) continue;
    if (motion != nullptr && touch.direction.dot(*motion) < -0.3) continue;
    if (!sample_band(field, center + touch.direction * radius_m, nearer_than_m, touch.distance_m,
                     touch.gradient))
      continue;
    if (touch.gradient.dot(touch.direction) > 0) continue;
    if (motion != nullptr && touch.gradient.dot(*motion) > -0.2) continue;
    out[count++] = {touch, false};
  }
  return count;
}

SphereSeed* lowest_unused(std::span<SphereSeed> seeds) noexcept {
  SphereSeed* best = nullptr;
  for (SphereSeed& seed : seeds)
    if (!seed.used && (best == nullptr || seed.touch.distance_m < best->touch.distance_m)) best = &seed;
  return best;
}

}  // namespace tactus::contact
