// The contact points of two ODE geoms, in ODE's form.
#pragma once

#include <ode/ode.h>

#include <span>

#include "pipeline/contact/field_contacts.hpp"

namespace tactus::contact {

/// `normal_sign` 1 when the contact's normal points towards g1's body, -1 when towards g2's.
dContactGeom ode_contact(const FieldContact& contact, double normal_sign, dGeomID g1, dGeomID g2) noexcept;

/// Contacts of two geoms, the number of them. Field against body: field_geom.hpp. Two spheres, two boxes and
/// sphere against anything: ODE's collider. All other pairs: body_contacts.hpp, and where that finds none the
/// one point of ODE's collider (crossing edges). Step phase; no heap.
int pair_contacts(dGeomID a, dGeomID b, std::span<dContact> out) noexcept;

}  // namespace tactus::contact
