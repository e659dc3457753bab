// What a body's surface points measured a moment ago: who has hardly moved need not ask the far ones again.
#pragma once

#include <array>
#include <cstdint>

#include "hal/transform.hpp"
#include "pipeline/contact/surface_points.hpp"

namespace tactus::contact {

/// One a body. While the field holds still, the answers are the same bits as without it: a point is left out
/// only when it cannot have come nearer than asked, at DistanceField::slope_max, and one that knew nothing is
/// always asked. All are asked every kSteps steps, bodies in turn: a change of the map is felt after 33 ms at
/// most, as long as a camera frame.
struct PointMemory {
  static constexpr std::uint32_t kSteps = 4;

  std::array<float, SurfacePoints::kMax> distances_m;
  std::size_t count = 0;  // 0: nothing yet
  std::uint32_t turn = 0;
  Vec3d center_world_m;
  Rotation R_world_body;
};

/// As surface_distances() for points nearer than `nearer_than_m`; of a farther one the answer may be the one
/// that is remembered, which is no nearer either. Step phase; wait-free.
void remembered_distances(const DistanceField& field, const SurfacePoints& surface, double reach_m,
                          const Vec3d& center_world_m, const Rotation& R_world_body, double nearer_than_m,
                          PointMemory& memory, std::span<float, SurfacePoints::kMax> distances_m) noexcept;

}  // namespace tactus::contact
