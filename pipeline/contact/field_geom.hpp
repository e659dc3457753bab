// The distance field as an ODE geom: one static geom that bodies collide with.
#pragma once

#include <ode/ode.h>

#include "pipeline/contact/distance_field.hpp"

namespace tactus::contact {

/// Creates the geom class and one geom of it in `space`. The field's context must outlive the geom. Geoms
/// that meet it carry their Shape as geom data (dGeomSetData). Boot, once per start_ode(); the geom's
/// collider (field_contacts.hpp) runs inside dCollide in the step phase.
dGeomID create_field_geom(dSpaceID space, const DistanceField& field);

}  // namespace tactus::contact
