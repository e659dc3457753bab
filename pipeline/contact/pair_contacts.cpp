#include "pipeline/contact/pair_contacts.hpp"

#include <algorithm>

#include "pipeline/contact/body_contacts.hpp"

namespace tactus::contact {
namespace {

const Shape* body_shape(dGeomID geom) {
  return dGeomGetBody(geom) == nullptr ? nullptr : static_cast<const Shape*>(dGeomGetData(geom));
}

Pose pose_of(dGeomID geom) {
  const dReal* p = dGeomGetPosition(geom);
  const dReal* r = dGeomGetRotation(geom);  // 3 rows of 4
  return {{p[0], p[1], p[2]}, {{r[0], r[1], r[2], r[4], r[5], r[6], r[8], r[9], r[10]}}};
}

bool is_fast(dGeomID a, dGeomID b) {
  const dReal* u = dBodyGetLinearVel(dGeomGetBody(a));
  const dReal* v = dBodyGetLinearVel(dGeomGetBody(b));
  const Vec3d relative{u[0] - v[0], u[1] - v[1], u[2] - v[2]};
  return relative.dot(relative) > kImpactSpeed * kImpactSpeed;
}

}  // namespace

dContactGeom ode_contact(const FieldContact& contact, double normal_sign, dGeomID g1, dGeomID g2) noexcept {
  const Vec3d normal = contact.normal_world * normal_sign;
  dContactGeom out{};
  out.pos[0] = contact.position_world_m.x;
  out.pos[1] = contact.position_world_m.y;
  out.pos[2] = contact.position_world_m.z;
  out.normal[0] = normal.x;
  out.normal[1] = normal.y;
  out.normal[2] = normal.z;
  out.depth = contact.depth_m;
  out.g1 = g1;
  out.g2 = g2;
  out.side1 = out.side2 = -1;
  return out;
}

int pair_contacts(dGeomID a, dGeomID b, std::span<dContact> out) noexcept {
  const int room = static_cast<int>(out.size());
  const Shape* shape_a = body_shape(a);
  const Shape* shape_b = body_shape(b);
  const bool by_points = shape_a != nullptr && shape_b != nullptr && shape_a->kind != ShapeKind::sphere &&
                         shape_b->kind != ShapeKind::sphere &&
                         !(shape_a->kind == ShapeKind::box && shape_b->kind == ShapeKind::box);
  if (!by_points) return dCollide(a, b, room, &out[0].geom, sizeof(dContact));

  dVector3 gravity;
  dWorldGetGravity(dBodyGetWorld(dGeomGetBody(a)), gravity);
  std::array<FieldContact, kFieldContactsMax> found;
  const int count = std::min(room, body_contacts(*shape_a, pose_of(a), *shape_b, pose_of(b),
                                                 is_fast(a, b) ? kImpactMarginM : kContactMarginM,
                                                 {-gravity[0], -gravity[1], -gravity[2]}, found));
  for (int i = 0; i < count; ++i) {
    const auto index = static_cast<std::size_t>(i);
    out[index].geom = ode_contact(found[index], 1, a, b);
  }
  return count > 0 ? count : dCollide(a, b, 1, &out[0].geom, sizeof(dContact));
}

}  // namespace tactus::contact
