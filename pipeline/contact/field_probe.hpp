// Single samples of a distance field that may carry a contact.
#pragma once

#include "pipeline/contact/distance_field.hpp"

namespace tactus::contact {

/// A distance inside the truncation band and nearer than `nearer_than_m`; an unknown one is not. Step phase;
/// wait-free.
inline bool is_in_band(const DistanceField& field, double distance_m, double nearer_than_m) noexcept {
  const double band_m = 0.95 * static_cast<double>(field.truncation_m);
  return distance_m > -band_m && distance_m < band_m && distance_m < nearer_than_m;
}

/// True when p was observed, is_in_band(), and the field has a direction there. Where most points are too
/// far, their distances are to be asked first, all at once. Step phase; wait-free.
inline bool sample_band(const DistanceField& field, const Vec3d& p, double nearer_than_m, double& distance_m,
                        Vec3d& gradient) noexcept {
  map::DistanceSample s;
  if (!field.sample(p, s)) return false;
  distance_m = static_cast<double>(s.distance_m);
  if (!is_in_band(field, distance_m, nearer_than_m)) return false;
  gradient = s.gradient.cast<double>();
  return gradient.dot(gradient) > 0.25;
}

/// True when the shape's centre is known to lie behind a surface. Step phase; wait-free.
inline bool center_is_behind(const DistanceField& field, const Vec3d& center) noexcept {
  double distance_m = 0;
  return field.distance(center, distance_m) && distance_m < 0;
}

}  // namespace tactus::contact
