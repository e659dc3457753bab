// The newest depth frame as a distance field, for places that the map does not know yet.
//
// A map needs some frames before it answers, and a body dropped in the first one would fall through the
// floor. Where the map says "never observed", the frame's own measurement is asked: the tangent plane of the
// surface that the point's pixel shows. On a plane that is the true distance, so that nothing jumps when the
// map takes over.
#pragma once

#include <cstdint>
#include <span>

#include "hal/calibration.hpp"
#include "pipeline/contact/distance_field.hpp"

namespace tactus::contact {

/// A depth frame and where it was taken. The owner fills it between steps of the world.
struct DepthView {
  std::span<const std::uint16_t> raw_depth;  // row-major, 0: no measurement
  double depth_m_per_unit = 0.001;
  hal::Intrinsics
      camera;  // as ideal: lens distortion is left out, a few pixels at the rim until the map knows
  T_WorldDepth T_world_depth;
  bool is_valid = false;  // false: nothing is known from it
};

/// What the depth frame alone says about p; as DistanceField::sample. A plane is fitted to 5 x 5
/// pixels up to 1.5 cm around the point's own, inverse depths being linear in the image of a plane; pixels
/// across a depth edge are left out. False where the pixel or its neighbours measure nothing, outside the
/// picture, and deeper than the truncation band. Step phase; wait-free.
bool sample_depth(const DepthView& view, double truncation_m, const Vec3d& p_world_m,
                  map::DistanceSample& out) noexcept;

/// The map first, the depth frame where it does not answer; materials and rays are the map's alone. Two references,
/// both must outlive the field that field() gives.
class DepthBackedField {
 public:
  DepthBackedField() = default;
  DepthBackedField(const DistanceField& map, const DepthView& view) : map_(map), view_(&view) {}

  /// Any phase. `this` is the context: it must outlive the field and stay where it is.
  [[nodiscard]] DistanceField field() const noexcept;

 private:
  DistanceField map_;
  const DepthView* view_ = nullptr;
};

}  // namespace tactus::contact
