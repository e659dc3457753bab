// A shape as ODE's geom and mass.
#pragma once

#include <ode/ode.h>

#include "pipeline/contact/shape.hpp"

namespace tactus::contact {

/// False for a shape without size, larger than 10 m, or without its hull. Any phase.
bool is_usable(const Shape& shape) noexcept;

/// A convex geom outside every space, to be lent to bodies that are hulls: ODE's constructor takes each edge
/// of a convex geom from the process's heap, past its own allocation handlers, so it must run at boot. Boot.
dGeomID create_spare_hull_geom();

/// The geom of a shape in `space`; `shape` becomes its data and must outlive it. A hull borrows
/// `spare_hull_geom`. Step phase; takes ODE's planned memory alone.
dGeomID create_body_geom(dSpaceID space, const Shape& shape, dGeomID spare_hull_geom) noexcept;
/// Destroys it, or takes a hull's out of its space. Step phase.
void release_body_geom(dGeomID geom) noexcept;

/// Step phase; wait-free.
dMass mass_of(const Shape& shape, double mass_kg) noexcept;

/// Radius that the shape rolls with on a surface of this normal, metres; 0 when it does not roll. A cylinder
/// rolls on its side. `axis_world`: its z, unit. Step phase; wait-free.
double rolling_radius_m(const Shape& shape, const Vec3d& axis_world, const Vec3d& normal_world) noexcept;

}  // namespace tactus::contact
