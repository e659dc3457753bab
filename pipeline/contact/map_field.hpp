// The live map as a distance field.
#pragma once

#include "pipeline/contact/distance_field.hpp"

namespace tactus::contact {

/// Any phase; lock-free. `reader` must outlive the field.
inline DistanceField field_of(const map::Reader& reader) {
  DistanceField field;
  field.context = &reader;
  field.truncation_m = reader.truncation_m();
  field.slope_max = 3.4641017F * reader.truncation_m() / reader.voxel_size_m();
  field.sample_fn = [](const void* context, const Vec3f& p, map::DistanceSample& out) noexcept {
    return static_cast<const map::Reader*>(context)->sample(p, out);
  };
  field.distances_fn = [](const void* context, std::span<const Vec3f> points, std::span<float> out) noexcept {
    static_cast<const map::Reader*>(context)->distances(points, out);
  };
  field.materials_fn = [](const void* context, const Vec3f& p, MaterialDistribution& out) noexcept {
    map::SurfacePoint surface;
    if (!static_cast<const map::Reader*>(context)->nearest_surface(p, surface)) return false;
    if (surface.material == kUnknownMaterial) return false;
    out = surface.materials;
    return true;
  };
  field.raycast_fn = [](const void* context, const Vec3f& origin, const Vec3f& direction, float range_m,
                        map::SurfacePoint& out) noexcept {
    return static_cast<const map::Reader*>(context)->raycast(origin, direction, range_m, out);
  };
  return field;
}

}  // namespace tactus::contact
