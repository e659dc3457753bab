// The convex hull of a few points, as a shape of virtual bodies.
#pragma once

#include <span>

#include "pipeline/contact/shape.hpp"
#include "rt/status.hpp"

namespace tactus::contact {

inline constexpr std::size_t kHullPointsMax = 64;

/// The hull of 4 to 64 points, metres, in any frame; `center_m` (may be null) receives its centre of mass
/// there, which is the hull's origin. Points inside it or inside a face are left out, coplanar triangles are
/// one face. Every plane through three points that has all others on one side is a face (n^4 comparisons: 0.1
/// ms for 16 points, 1 for 32). Integrals over tetrahedra about the first corner. Boot; may allocate for its
/// sentence alone. bad_usage: fewer than 4 or more than 64 points, one that is not finite, all in one plane,
/// or more than 32 corners.
rt::Result<ConvexHull> make_hull(std::span<const Vec3d> points, Vec3d* center_m = nullptr);

}  // namespace tactus::contact
