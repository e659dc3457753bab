// A floor in stripes of one metre, each of another material, presented as a finished map would.
#pragma once

#include <cmath>
#include <span>
#include <string_view>

#include "pipeline/contact/distance_field.hpp"

namespace tactus::test {

/// y = 0; stripe i covers i <= x < i + 1; beyond them nothing is labelled.
class StripedFloor {
 public:
  explicit StripedFloor(std::span<const std::string_view> materials) : materials_(materials) {}

  [[nodiscard]] contact::DistanceField field() const {
    contact::DistanceField f;
    f.context = this;
    f.truncation_m = 0.04F;
    f.sample_fn = [](const void*, const Vec3f& p, map::DistanceSample& out) noexcept {
      if (std::abs(p.y) > 0.04F) return false;
      out = {p.y, {0, 1, 0}};
      return true;
    };
    f.materials_fn = [](const void* self, const Vec3f& p, MaterialDistribution& out) noexcept {
      return static_cast<const StripedFloor*>(self)->materials_at(p.x, out);
    };
    f.raycast_fn = [](const void* self, const Vec3f& origin, const Vec3f& direction, float range_m,
                      map::SurfacePoint& out) noexcept {
      if (!(direction.y < 0) || origin.y < 0) return false;
      const float t = -origin.y / direction.y;
      if (t * direction.norm() > range_m) return false;
      out = {};
      out.position_world_m = origin + direction * t;
      out.normal_world = {0, 1, 0};
      out.color = {10, 20, 30};
      if (static_cast<const StripedFloor*>(self)->materials_at(out.position_world_m.x, out.materials))
        out.material = material_at(*static_cast<const StripedFloor*>(self), out.position_world_m.x);
      return true;
    };
    return f;
  }

 private:
  static MaterialId material_at(const StripedFloor& floor, float x) {
    const auto stripe = static_cast<std::ptrdiff_t>(std::floor(x));
    if (stripe < 0 || stripe >= static_cast<std::ptrdiff_t>(floor.materials_.size())) return kUnknownMaterial;
    return material_from_name(floor.materials_[static_cast<std::size_t>(stripe)]);
  }
  bool materials_at(float x, MaterialDistribution& out) const {
    const MaterialId id = material_at(*this, x);
    if (id == kUnknownMaterial) return false;
    out = {};
    out[id] = 1;
    return true;
  }
  std::span<const std::string_view> materials_;
};

}  // namespace tactus::test
