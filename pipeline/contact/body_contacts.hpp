// Where two bodies touch: each one's surface points against the other as a distance field.
#pragma once

#include <span>

#include "pipeline/contact/field_contacts.hpp"

namespace tactus::contact {

struct Pose {
  Vec3d center_world_m;
  Rotation R_world_body;
};

/// Signed distance to the surface of a shape in its own frame, metres, and its unit gradient: exact for all
/// but hulls, which answer with the plane that is farthest out (exact inside and in front of faces, too near
/// in front of edges). Step phase; wait-free.
double shape_distance(const Shape& shape, const Vec3d& p_body_m, Vec3d& gradient_body) noexcept;

/// Contacts of `a` with `b`, normals towards `a`; the number of them. As field_contacts(), from the points of
/// both, so that a face on a face is held by its corners and does not rock as on the one point that ODE's
/// colliders give to hulls. Two crossing edges may have no point in each other: then 0, and ODE's collider is
/// to be asked. Step phase; wait-free.
int body_contacts(const Shape& a, const Pose& pose_a, const Shape& b, const Pose& pose_b, double margin_m,
                  const Vec3d& up_world, std::span<FieldContact, kFieldContactsMax> out) noexcept;

}  // namespace tactus::contact
