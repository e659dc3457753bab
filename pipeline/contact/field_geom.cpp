#include "pipeline/contact/field_geom.hpp"

#include <array>
#include <cstring>

#include "pipeline/contact/field_contacts.hpp"
#include "pipeline/contact/pair_contacts.hpp"
#include "pipeline/contact/point_memory.hpp"
#include "rt/assert.hpp"

namespace tactus::contact {
namespace {

struct FieldGeom {
  DistanceField field;
  PointMemory* memories = nullptr;
};

const FieldGeom& field_of_geom(dGeomID geom) {
  return *static_cast<const FieldGeom*>(dGeomGetClassData(geom));
}

// dCollide writes contacts `skip` bytes apart, with the normal pointing into the first geom. The field comes
// first, so the normal that pushes the body out is written negated.
int collide(dGeomID field_geom, dGeomID body_geom, int flags, dContactGeom* out, int skip) {
  std::array<FieldContact, kFieldContactsMax> contacts;
  const auto& [field, memories] = field_of_geom(field_geom);
  const dReal* p = dGeomGetPosition(body_geom);
  const Vec3d center{p[0], p[1], p[2]};
  const dBodyID body = dGeomGetBody(body_geom);
  const dReal* r = dGeomGetRotation(body_geom);  // 3 rows of 4
  const Rotation R_world_body{{r[0], r[1], r[2], r[4], r[5], r[6], r[8], r[9], r[10]}};
  const dReal* v = dBodyGetLinearVel(body);
  const bool is_fast = v[0] * v[0] + v[1] * v[1] + v[2] * v[2] > kImpactSpeed * kImpactSpeed;
  dVector3 gravity;
  dWorldGetGravity(dBodyGetWorld(body), gravity);
  int count =
      field_contacts(field, *static_cast<const Shape*>(dGeomGetData(body_geom)), center, R_world_body,
                     is_fast ? kImpactMarginM : kContactMarginM, {-gravity[0], -gravity[1], -gravity[2]},
                     contacts, memories + reinterpret_cast<std::uintptr_t>(dBodyGetData(body)));
  const int room = flags & 0xffff;
  if (count > room) count = room;
  for (int i = 0; i < count; ++i) {
    *reinterpret_cast<dContactGeom*>(reinterpret_cast<char*>(out) + i * skip) =
        ode_contact(contacts[static_cast<std::size_t>(i)], -1, field_geom, body_geom);
  }
  return count;
}

dColliderFn* collider_for(int other_class) {
  const bool has_shape = other_class == dSphereClass || other_class == dBoxClass ||
                         other_class == dCapsuleClass || other_class == dCylinderClass ||
                         other_class == dConvexClass;
  return has_shape ? collide : nullptr;
}

void everywhere(dGeomID, dReal aabb[6]) {
  aabb[0] = aabb[2] = aabb[4] = -dInfinity;
  aabb[1] = aabb[3] = aabb[5] = dInfinity;
}

}  // namespace

dGeomID create_field_geom(dSpaceID space, const DistanceField& field, std::span<PointMemory> memories) {
  dGeomClass description;
  std::memset(&description, 0, sizeof description);
  description.bytes = sizeof(FieldGeom);
  description.collider = collider_for;
  description.aabb = everywhere;
  const int field_class = dCreateGeomClass(&description);
  dGeomID geom = dCreateGeom(field_class);
  TACTUS_ASSERT(geom != nullptr);
  *static_cast<FieldGeom*>(dGeomGetClassData(geom)) = {field, memories.data()};
  dSpaceAdd(space, geom);
  return geom;
}

}  // namespace tactus::contact
