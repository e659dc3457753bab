// An empty room of six walls: exact, as a ray function.
#pragma once

#include <array>
#include <cmath>

#include "pipeline/sound/room_sound.hpp"

namespace tactus::sound::test {

/// Walls in the order -x, +x, -y, +y, -z, +z; kUnknownMaterial: nothing was labelled. `turn` rotates the room
/// about the vertical, so that walls and rays do not line up.
struct Shoebox {
  Vec3d low_m{-2, 0, -3}, high_m{2, 2.5, 3};
  std::array<MaterialId, 6> materials{};
  std::array<bool, 6> is_mapped{true, true, true, true, true, true};
  Rotation turn;

  explicit Shoebox(MaterialId material = material_from_name("painted")) { materials.fill(material); }

  [[nodiscard]] bool cast(const Vec3d& origin, const Vec3d& direction, double range_m,
                          map::SurfacePoint& out) const {
    const Vec3d o = turn.transposed() * origin, d = turn.transposed() * direction.normalized();
    const std::array<double, 3> from{o.x, o.y, o.z}, along{d.x, d.y, d.z}, low{low_m.x, low_m.y, low_m.z},
        high{high_m.x, high_m.y, high_m.z};
    double nearest = 1e9;
    std::size_t wall = 6;
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (std::size_t side = 0; side < 2; ++side) {
        if (side == 0 ? along[axis] >= 0 : along[axis] <= 0) continue;
        const double s = ((side == 0 ? low[axis] : high[axis]) - from[axis]) / along[axis];
        if (s >= 0 && s < nearest) {
          nearest = s;
          wall = 2 * axis + side;
        }
      }
    if (wall == 6 || nearest > range_m || !is_mapped[wall]) return false;
    out = {};
    out.position_world_m = (origin + direction.normalized() * nearest).cast<float>();
    const double sign = wall % 2 == 0 ? 1 : -1;
    out.normal_world =
        (turn * Vec3d{wall / 2 == 0 ? sign : 0, wall / 2 == 1 ? sign : 0, wall / 2 == 2 ? sign : 0})
            .cast<float>();
    out.material = materials[wall];
    out.materials.fill(out.material == kUnknownMaterial ? 1.0F / kMaterialCount : 0.0F);
    if (out.material != kUnknownMaterial) out.materials[out.material] = 1;
    return true;
  }

  [[nodiscard]] contact::DistanceField rays() const {
    return contact::rays_only(this, [](const void* context, const Vec3f& origin, const Vec3f& direction, float range_m_max,
                     map::SurfacePoint& out) noexcept {
              return static_cast<const Shoebox*>(context)->cast(
                  origin.cast<double>(), direction.cast<double>(), static_cast<double>(range_m_max), out);
            });
  }
};

}  // namespace tactus::sound::test
