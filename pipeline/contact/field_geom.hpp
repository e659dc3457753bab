// The distance field as an ODE geom: one static geom that bodies collide with.
#pragma once

#include <ode/ode.h>

#include <span>

#include "pipeline/contact/point_memory.hpp"

namespace tactus::contact {

/// Creates the geom class and one geom of it in `space`. The field's context must outlive the geom. Geoms
/// that meet it carry their Shape as geom data (dGeomSetData), and the index of their memory as their body's
/// (dBodySetData). Boot, once per start_ode(); the geom's
/// collider (field_contacts.hpp) runs inside dCollide in the step phase.
dGeomID create_field_geom(dSpaceID space, const DistanceField& field, std::span<PointMemory> memories);

}  // namespace tactus::contact
