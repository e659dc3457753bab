#include "pipeline/contact/field_contacts.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "pipeline/contact/field_probe.hpp"
#include "pipeline/contact/point_contacts.hpp"
#include "pipeline/contact/sphere_touch.hpp"

namespace tactus::contact {
namespace {

constexpr int kSphereContactsMax = 4;

int sphere_contacts(const DistanceField& field, const Vec3d& center, double radius_m,
                    std::span<FieldContact, kFieldContactsMax> out) {
  SphereSeeds seeds;
  const std::size_t seeds_count =
      sample_seeds(field, center, radius_m, kSeedReach * radius_m + kContactMarginM, nullptr, seeds);
  const std::span<SphereSeed> samples = std::span(seeds).first(seeds_count);

  std::array<Vec3d, 6> visited;
  std::size_t visited_count = 0;
  int count = 0;
  while (count < kSphereContactsMax && visited_count < visited.size()) {
    SphereSeed* seed = lowest_unused(samples);
    if (seed == nullptr) break;
    seed->used = true;
    const auto same = [&](const Vec3d& direction) {
      for (std::size_t i = 0; i < visited_count; ++i)
        if (visited[i].dot(direction) > kSameDirectionCosine) return true;
      return false;
    };
    if (same(seed->touch.direction)) continue;
    SphereTouch touch = seed->touch;
    descend(field, center, radius_m, touch);
    if (same(touch.direction)) continue;
    visited[visited_count++] = touch.direction;
    if (touch.distance_m >= kContactMarginM || touch.gradient.dot(touch.direction) > kFacingCosine) continue;
    out[static_cast<std::size_t>(count++)] = {
        center + touch.direction * radius_m, touch.gradient.normalized(), kContactMarginM - touch.distance_m};
  }
  return count;
}

}  // namespace

int field_contacts(const DistanceField& field, const Shape& shape, const Vec3d& center,
                   const Rotation& R_world_body, double margin_m, const Vec3d& up_world,
                   std::span<FieldContact, kFieldContactsMax> out, PointMemory* memory) noexcept {
  if (center_is_behind(field, center)) return 0;
  if (shape.kind == ShapeKind::sphere) return sphere_contacts(field, center, shape.radius_m, out);

  Candidates candidates;
  collect(field, shape, center, R_world_body, static_cast<double>(field.truncation_m), margin_m, candidates,
          memory);
  return reduce(candidates, up_world, out);
}

}  // namespace tactus::contact
