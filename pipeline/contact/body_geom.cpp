#include "pipeline/contact/body_geom.hpp"

#include <algorithm>
#include <cmath>

namespace tactus::contact {
namespace {

/// What a spare geom is until a hull borrows it: a box of 10 cm.
constexpr ConvexHull make_box_hull() {
  constexpr double h = 0.05;
  ConvexHull hull;
  hull.vertices_count = 8;
  hull.faces_count = 6;
  for (std::size_t i = 0; i < 8; ++i) hull.vertices_m[i] = {i & 1 ? h : -h, i & 2 ? h : -h, i & 4 ? h : -h};
  hull.planes[0] = {1, 0, 0, h};
  hull.planes[1] = {-1, 0, 0, h};
  hull.planes[2] = {0, 1, 0, h};
  hull.planes[3] = {0, -1, 0, h};
  hull.planes[4] = {0, 0, 1, h};
  hull.planes[5] = {0, 0, -1, h};
  constexpr unsigned kPolygons[30] = {4, 1, 3, 7, 5, 4, 0, 4, 6, 2, 4, 2, 6, 7, 3,
                                      4, 0, 1, 5, 4, 4, 4, 5, 7, 6, 4, 0, 2, 3, 1};
  for (std::size_t i = 0; i < 30; ++i) hull.polygons[i] = kPolygons[i];
  return hull;
}
constexpr ConvexHull kBoxHull = make_box_hull();

bool is_size(double m) { return m > 1e-4 && m < 10; }

}  // namespace

bool is_usable(const Shape& shape) noexcept {
  const Vec3d& e = shape.half_extents_m;
  switch (shape.kind) {
    case ShapeKind::sphere:
      return is_size(shape.radius_m);
    case ShapeKind::box:
      return is_size(e.x) && is_size(e.y) && is_size(e.z);
    case ShapeKind::capsule:
    case ShapeKind::cylinder:
      return is_size(shape.radius_m) && is_size(shape.half_length_m);
    case ShapeKind::hull:
      return shape.hull != nullptr && shape.hull->faces_count >= 4 && is_size(shape.hull->radius_m) &&
             shape.hull->volume_m3 > 0;
  }
  return false;
}

dGeomID create_spare_hull_geom() {
  return dCreateConvex(nullptr, kBoxHull.planes[0].data(), static_cast<unsigned>(kBoxHull.faces_count),
                       kBoxHull.vertices_m[0].data(), static_cast<unsigned>(kBoxHull.vertices_count),
                       kBoxHull.polygons.data());
}

dGeomID create_body_geom(dSpaceID space, const Shape& shape, dGeomID spare_hull_geom) noexcept {
  dGeomID geom = nullptr;
  const Vec3d edges = shape.half_extents_m * 2;
  switch (shape.kind) {
    case ShapeKind::sphere:
      geom = dCreateSphere(space, shape.radius_m);
      break;
    case ShapeKind::box:
      geom = dCreateBox(space, edges.x, edges.y, edges.z);
      break;
    case ShapeKind::capsule:
      geom = dCreateCapsule(space, shape.radius_m, 2 * shape.half_length_m);
      break;
    case ShapeKind::cylinder:
      geom = dCreateCylinder(space, shape.radius_m, 2 * shape.half_length_m);
      break;
    case ShapeKind::hull: {
      // The edges stay the box's: only ODE's colliders without libccd read them, and every pair has one with
      // it.
      const ConvexHull& hull = *shape.hull;
      geom = spare_hull_geom;
      dGeomSetConvex(geom, hull.planes[0].data(), static_cast<unsigned>(hull.faces_count),
                     hull.vertices_m[0].data(), static_cast<unsigned>(hull.vertices_count),
                     hull.polygons.data());
      dSpaceAdd(space, geom);
      break;
    }
  }
  dGeomSetData(geom, const_cast<Shape*>(&shape));
  return geom;
}

void release_body_geom(dGeomID geom) noexcept {
  if (dGeomGetClass(geom) != dConvexClass) {
    dGeomDestroy(geom);
    return;
  }
  dSpaceRemove(dGeomGetSpace(geom), geom);
  dGeomSetBody(geom, nullptr);
}

dMass mass_of(const Shape& shape, double mass_kg) noexcept {
  constexpr int kAlongZ = 3;
  dMass mass;
  const Vec3d edges = shape.half_extents_m * 2;
  const double length_m = 2 * shape.half_length_m;
  switch (shape.kind) {
    case ShapeKind::sphere:
      dMassSetSphereTotal(&mass, mass_kg, shape.radius_m);
      break;
    case ShapeKind::box:
      dMassSetBoxTotal(&mass, mass_kg, edges.x, edges.y, edges.z);
      break;
    case ShapeKind::capsule:
      dMassSetCapsuleTotal(&mass, mass_kg, kAlongZ, shape.radius_m, length_m);
      break;
    case ShapeKind::cylinder:
      dMassSetCylinderTotal(&mass, mass_kg, kAlongZ, shape.radius_m, length_m);
      break;
    case ShapeKind::hull: {
      const std::array<double, 6>& i = shape.hull->inertia_m2;
      dMassSetParameters(&mass, mass_kg, 0, 0, 0, mass_kg * i[0], mass_kg * i[1], mass_kg * i[2],
                         mass_kg * i[3], mass_kg * i[4], mass_kg * i[5]);
      break;
    }
  }
  return mass;
}

double rolling_radius_m(const Shape& shape, const Vec3d& axis_world, const Vec3d& normal_world) noexcept {
  switch (shape.kind) {
    case ShapeKind::sphere:
    case ShapeKind::capsule:
      return shape.radius_m;
    case ShapeKind::cylinder:
      return std::abs(axis_world.dot(normal_world)) < 0.5 ? shape.radius_m : 0;
    case ShapeKind::box:
    case ShapeKind::hull:
      return 0;
  }
  return 0;
}

}  // namespace tactus::contact
