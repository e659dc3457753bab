// Where a shape touches a distance field: kernels without ODE.
//
// A shape is tested by points of its own surface, never by the distance at its centre: a ball larger than the
// truncation distance has a saturated centre, and a projective distance is only exact near zero, where the
// surface points are. Three rules keep virtual things out of trouble with a map that has been seen from one
// side:
//   - a point in unseen space touches nothing;
//   - a point deeper than the truncation band touches nothing: it is behind the surface, not in it;
//   - a contact must push the shape's centre away from the surface, and the centre must not itself be behind
//   it:
//     the back of a surface neither stops a body nor sucks it through.
#pragma once

#include <span>

#include "pipeline/contact/distance_field.hpp"
#include "pipeline/contact/shape.hpp"

namespace tactus::contact {

struct PointMemory;

/// Contacts begin this far in front of the surface and rest where depth equals it, that is, at distance zero:
/// a resting body keeps its contacts from step to step instead of losing them to rounding. 0.5 mm is a
/// twentieth of a voxel.
inline constexpr double kContactMarginM = 0.0005;
inline constexpr int kFieldContactsMax = 8;  // a box in a corner: 4 on the floor, 2 on each wall

struct FieldContact {
  Vec3d position_world_m;  // on the shape's surface
  Vec3d normal_world;      // unit, towards free space: pushes the shape out
  double depth_m = 0;      // >= 0, counted from kContactMarginM in front of the surface
};

/// Anything but a sphere that moves faster than this gathers contacts from kImpactMarginM: on a rough surface
/// a flat impact is taken by the whole face, not by the corner that is first by a hair, which would turn its
/// speed into spin.
inline constexpr double kImpactSpeed = 0.5;
inline constexpr double kImpactMarginM = 0.002;

/// Contacts of a shape; the number of them. `up_world` (any length, may be zero) tells the face that carries
/// the shape from those that only hold it. `memory`: of the body that calls once a step, null for others.
/// Step phase; wait-free.
///
/// Sphere: one per distinct surface direction (floor, wall, corner), at most 4. Up to 26 seed directions are
/// sampled and the lowest of each neighbourhood descends to the deepest point of the sphere (fixed point
/// direction = -gradient, bracketed on sharp bumps). Radius up to about 8 truncation distances.
///
/// Others: points of the surface no wider apart than the truncation distance (surface_points.hpp), on round
/// parts turned to the deepest point beside them, that are closer than `margin_m`; grouped by normal, each
/// group reduced to at most 4 spread far apart. None unless one is closer than kContactMarginM.
int field_contacts(const DistanceField& field, const Shape& shape, const Vec3d& center_world_m,
                   const Rotation& R_world_body, double margin_m, const Vec3d& up_world,
                   std::span<FieldContact, kFieldContactsMax> out, PointMemory* memory = nullptr) noexcept;

/// Conservative advancement (Mirtich 1996): the fraction of `displacement` that the shape can travel until it
/// first touches a surface that it moves towards at more than 12 degrees; 1 when it can travel all of it.
/// Orientation is held. What it touches where it starts is in the solver's hands and stops it only after
/// sinking 5 mm deeper: a rolling ball is not caught by the roughness of the floor, but by the wall at its
/// end. Bounded to 128 field evaluations of the shape; when those do not suffice it is stopped where it is
/// known to be free. Step phase; wait-free.
double free_fraction(const DistanceField& field, const Shape& shape, const Vec3d& from_world_m,
                     const Rotation& R_world_body, const Vec3d& displacement_m) noexcept;

}  // namespace tactus::contact
