#include "pipeline/contact/body_contacts.hpp"

#include <algorithm>
#include <cmath>

#include "pipeline/contact/point_contacts.hpp"

namespace tactus::contact {
namespace {

Vec3d sign_of(const Vec3d& v) {
  return {std::copysign(1.0, v.x), std::copysign(1.0, v.y), std::copysign(1.0, v.z)};
}

double box_distance(const Vec3d& half, const Vec3d& p, Vec3d& gradient) {
  const Vec3d sign = sign_of(p);
  const Vec3d q{std::abs(p.x) - half.x, std::abs(p.y) - half.y, std::abs(p.z) - half.z};
  const Vec3d outside{std::max(q.x, 0.0), std::max(q.y, 0.0), std::max(q.z, 0.0)};
  const double away_m = outside.norm();
  if (away_m > 0) {
    gradient = Vec3d{outside.x * sign.x, outside.y * sign.y, outside.z * sign.z} * (1 / away_m);
    return away_m;
  }
  if (q.x >= q.y && q.x >= q.z) {
    gradient = {sign.x, 0, 0};
    return q.x;
  }
  gradient = q.y >= q.z ? Vec3d{0, sign.y, 0} : Vec3d{0, 0, sign.z};
  return std::max(q.y, q.z);
}

double cylinder_distance(double radius_m, double half_length_m, const Vec3d& p, Vec3d& gradient) {
  const double rho = std::sqrt(p.x * p.x + p.y * p.y);
  const Vec3d radial = rho > 1e-12 ? Vec3d{p.x / rho, p.y / rho, 0} : Vec3d{1, 0, 0};
  const Vec3d axial{0, 0, std::copysign(1.0, p.z)};
  const double side_m = rho - radius_m, end_m = std::abs(p.z) - half_length_m;
  if (side_m > 0 && end_m > 0) {
    const double away_m = std::sqrt(side_m * side_m + end_m * end_m);
    gradient = radial * (side_m / away_m) + axial * (end_m / away_m);
    return away_m;
  }
  gradient = side_m > end_m ? radial : axial;
  return std::max(side_m, end_m);
}

double hull_distance(const ConvexHull& hull, const Vec3d& p, Vec3d& gradient) {
  double farthest_m = -1e30;
  std::size_t face = 0;
  for (std::size_t f = 0; f < hull.faces_count; ++f) {
    const std::array<double, 4>& plane = hull.planes[f];
    const double out_m = plane[0] * p.x + plane[1] * p.y + plane[2] * p.z - plane[3];
    if (out_m > farthest_m) {
      farthest_m = out_m;
      face = f;
    }
  }
  gradient = {hull.planes[face][0], hull.planes[face][1], hull.planes[face][2]};
  return farthest_m;
}

bool is_round(const Shape& shape) {
  return shape.kind == ShapeKind::capsule || shape.kind == ShapeKind::cylinder;
}

/// A body as what the other one's points are tested against.
struct BodyField {
  BodyField(const Shape& of_shape, const Pose& at)
      : shape(of_shape), pose(at), R_body_world(at.R_world_body.transposed()) {}

  const Shape& shape;
  const Pose& pose;
  Rotation R_body_world;

  [[nodiscard]] float distance(const Vec3f& p_world, Vec3d& gradient_body) const {
    return static_cast<float>(
        shape_distance(shape, R_body_world * (p_world.cast<double>() - pose.center_world_m), gradient_body));
  }

  /// Distances are exact or too short: true is certain.
  [[nodiscard]] bool is_beyond(const Vec3d& p_world, double distance_m) const {
    Vec3d gradient;
    return shape_distance(shape, R_body_world * (p_world - pose.center_world_m), gradient) > distance_m;
  }

  [[nodiscard]] DistanceField field() const {
    DistanceField f;
    f.context = this;
    f.truncation_m = 2 * static_cast<float>(reach_m(shape));  // known everywhere inside
    f.sample_fn = [](const void* context, const Vec3f& p_world, map::DistanceSample& out) noexcept {
      const auto& self = *static_cast<const BodyField*>(context);
      Vec3d gradient;
      out.distance_m = self.distance(p_world, gradient);
      out.gradient = (self.pose.R_world_body * gradient).cast<float>();
      return true;
    };
    f.distances_fn = [](const void* context, std::span<const Vec3f> points, std::span<float> out) noexcept {
      const auto& self = *static_cast<const BodyField*>(context);
      Vec3d gradient;
      for (std::size_t i = 0; i < points.size(); ++i) out[i] = self.distance(points[i], gradient);
    };
    return f;
  }
};

}  // namespace

double shape_distance(const Shape& shape, const Vec3d& p, Vec3d& gradient) noexcept {
  switch (shape.kind) {
    case ShapeKind::box:
      return box_distance(shape.half_extents_m, p, gradient);
    case ShapeKind::cylinder:
      return cylinder_distance(shape.radius_m, shape.half_length_m, p, gradient);
    case ShapeKind::hull:
      return hull_distance(*shape.hull, p, gradient);
    case ShapeKind::sphere:
    case ShapeKind::capsule:
      break;
  }
  const double h = shape.kind == ShapeKind::capsule ? shape.half_length_m : 0;
  const Vec3d arm = p - Vec3d{0, 0, std::clamp(p.z, -h, h)};
  const double away_m = arm.norm();
  gradient = away_m > 0 ? arm * (1 / away_m) : Vec3d{1, 0, 0};
  return away_m - shape.radius_m;
}

int body_contacts(const Shape& a, const Pose& pose_a, const Shape& b, const Pose& pose_b, double margin_m,
                  const Vec3d& up_world, std::span<FieldContact, kFieldContactsMax> out) noexcept {
  const BodyField field_a(a, pose_a), field_b(b, pose_b);
  if (field_b.is_beyond(pose_a.center_world_m, reach_m(a) + margin_m) ||
      field_a.is_beyond(pose_b.center_world_m, reach_m(b) + margin_m))
    return 0;
  // Half the smaller body: what is missed between points, ODE finds (edges that cross).
  const double spacing_m = std::min(reach_m(a), reach_m(b));
  // A point of a flat face inside a round body has the normal of the round one, not the face's, and would
  // push it aside: then the round one's deepest points speak first.
  const bool round_a = is_round(a), round_b = is_round(b);
  Candidates candidates;
  const auto ask_a = [&] {
    collect(field_b.field(), a, pose_a.center_world_m, pose_a.R_world_body, spacing_m, margin_m, candidates);
  };
  const auto ask_b = [&] {
    const std::size_t before = candidates.count;
    collect(field_a.field(), b, pose_b.center_world_m, pose_b.R_world_body, spacing_m, margin_m, candidates);
    for (FieldContact& contact : std::span(candidates.items).subspan(before, candidates.count - before))
      contact.normal_world = -contact.normal_world;
  };
  if (round_a || !round_b) ask_a();
  if (round_b || !round_a || !candidates.touches) ask_b();
  if (round_b && !round_a && !candidates.touches) ask_a();
  return reduce(candidates, up_world, out);
}

}  // namespace tactus::contact
