#include "hal/synthetic/raycast_kernel.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "hal/synthetic/raycast_kernel.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace tactus::hal::synthetic {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using D = hn::CappedTag<double, TileRays::kCount>;
using V = hn::Vec<D>;
using M = hn::Mask<D>;

constexpr double kFar_m = 1e9;
constexpr double kHit_m = 1e-6;  // steps end this near to the surface, 50 times below the promised 0.05 mm

HWY_INLINE V square_sum(V x, V y) { return hn::Add(hn::Mul(x, x), hn::Mul(y, y)); }
HWY_INLINE V dot3(V ax, V ay, V az, V bx, V by, V bz) {
  return hn::Add(hn::Add(hn::Mul(ax, bx), hn::Mul(ay, by)), hn::Mul(az, bz));
}
/// 1/d with a zero replaced by a tiny number of the same sign: a ray parallel to a face stays a number.
HWY_INLINE V safe_inverse(D d, V v) {
  const V tiny = hn::Set(d, 1e-12);
  return hn::Div(hn::Set(d, 1.0), hn::CopySign(hn::Max(hn::Abs(v), tiny), v));
}

HWY_INLINE V distance_to(D d, const Primitive& s, V px, V py, V pz) {
  const V zero = hn::Zero(d);
  switch (s.shape) {
    case Shape::capsule: {
      const V half = hn::Set(d, s.b);
      const V y = hn::Sub(py, hn::Min(hn::Max(py, hn::Neg(half)), half));
      return hn::Sub(hn::Sqrt(hn::Add(square_sum(px, y), hn::Mul(pz, pz))), hn::Set(d, s.a));
    }
    case Shape::torus: {
      const V x = hn::Sub(hn::Sqrt(square_sum(px, pz)), hn::Set(d, s.a));
      return hn::Sub(hn::Sqrt(square_sum(x, py)), hn::Set(d, s.b));
    }
    case Shape::frustum: {
      const V q = hn::Sqrt(square_sum(px, pz));
      const V top = hn::Set(d, s.c), half = hn::Set(d, s.b);
      const V rim = hn::IfThenElse(hn::Lt(py, zero), hn::Set(d, s.a), top);
      const V cap_x = hn::Sub(q, hn::Min(q, rim)), cap_y = hn::Sub(hn::Abs(py), half);
      const V up_x = hn::Set(d, s.c - s.a), up_y = hn::Set(d, 2 * s.b);
      const V inverse = hn::Set(d, 1.0 / ((s.c - s.a) * (s.c - s.a) + 4 * s.b * s.b));
      V along = hn::Mul(hn::Add(hn::Mul(hn::Sub(top, q), up_x), hn::Mul(hn::Sub(half, py), up_y)), inverse);
      along = hn::Min(hn::Max(along, zero), hn::Set(d, 1.0));
      const V side_x = hn::Add(hn::Sub(q, top), hn::Mul(up_x, along));
      const V side_y = hn::Add(hn::Sub(py, half), hn::Mul(up_y, along));
      const V out = hn::Sqrt(hn::Min(square_sum(cap_x, cap_y), square_sum(side_x, side_y)));
      const M inside = hn::And(hn::Lt(side_x, zero), hn::Lt(cap_y, zero));
      return hn::IfThenElse(inside, hn::Neg(out), out);
    }
    case Shape::shell: {
      const V qx = hn::Sub(hn::Sqrt(square_sum(px, pz)), hn::Set(d, s.a)), qy = hn::Add(py, hn::Set(d, s.b));
      const V up_x = hn::Set(d, s.c - s.a), up_y = hn::Set(d, 2 * s.b);
      const V inverse = hn::Set(d, 1.0 / ((s.c - s.a) * (s.c - s.a) + 4 * s.b * s.b));
      V along = hn::Mul(hn::Add(hn::Mul(qx, up_x), hn::Mul(qy, up_y)), inverse);
      along = hn::Min(hn::Max(along, zero), hn::Set(d, 1.0));
      const V x = hn::Sub(qx, hn::Mul(up_x, along)), y = hn::Sub(qy, hn::Mul(up_y, along));
      return hn::Sub(hn::Sqrt(square_sum(x, y)), hn::Set(d, s.r));
    }
    case Shape::box:
    case Shape::sphere:
    case Shape::cylinder:
      break;
  }
  // Box, here with round edges.
  const V qx = hn::Sub(hn::Abs(px), hn::Set(d, s.a - s.r)), qy = hn::Sub(hn::Abs(py), hn::Set(d, s.b - s.r)),
          qz = hn::Sub(hn::Abs(pz), hn::Set(d, s.c - s.r));
  const V inside = hn::Min(hn::Max(qx, hn::Max(qy, qz)), zero);
  const V ox = hn::Max(qx, zero), oy = hn::Max(qy, zero), oz = hn::Max(qz, zero);
  const V outside = hn::Sqrt(hn::Add(square_sum(ox, oy), hn::Mul(oz, oz)));
  return hn::Sub(hn::Add(outside, inside), hn::Set(d, s.r));
}

/// The part of the ray inside a slab |coordinate| <= half.
HWY_INLINE void clip_to_slab(D d, V origin, V direction, double half, V& enter, V& leave) {
  const V inverse = safe_inverse(d, direction);
  const V middle = hn::Neg(hn::Mul(origin, inverse)), extent = hn::Mul(hn::Set(d, half), hn::Abs(inverse));
  enter = hn::Max(enter, hn::Sub(middle, extent));
  leave = hn::Min(leave, hn::Add(middle, extent));
}

/// The part of the ray inside an infinite cylinder about y (with_y false) or a sphere (true); empty when it
/// misses.
HWY_INLINE void clip_to_round(D d, V ox, V oy, V oz, V dx, V dy, V dz, bool with_y, double radius, V& enter,
                              V& leave) {
  V a = square_sum(dx, dz), b = hn::Add(hn::Mul(ox, dx), hn::Mul(oz, dz)), c = square_sum(ox, oz);
  if (with_y) {
    a = hn::Add(a, hn::Mul(dy, dy));
    b = hn::Add(b, hn::Mul(oy, dy));
    c = hn::Add(c, hn::Mul(oy, oy));
  }
  a = hn::Max(a, hn::Set(d, 1e-12));
  c = hn::Sub(c, hn::Set(d, radius * radius));
  const V discriminant = hn::Sub(hn::Mul(b, b), hn::Mul(a, c));
  const M misses = hn::Lt(discriminant, hn::Zero(d));
  const V root = hn::Sqrt(hn::Max(discriminant, hn::Zero(d)));
  const V inverse = hn::Div(hn::Set(d, 1.0), a);
  enter =
      hn::Max(enter, hn::IfThenElse(misses, hn::Set(d, kFar_m), hn::Mul(hn::Neg(hn::Add(b, root)), inverse)));
  leave = hn::Min(leave, hn::IfThenElse(misses, hn::Set(d, -kFar_m), hn::Mul(hn::Sub(root, b), inverse)));
}

/// Steps from `enter` to the surface. Along a ray the distance to a convex solid is a convex function, so
/// that the secant through two samples before the surface never lands behind it; other solids are stepped by
/// distance alone.
HWY_INLINE V march(D d, const Primitive& s, V ox, V oy, V oz, V dx, V dy, V dz, V enter, V leave, M active) {
  const bool is_convex = s.shape != Shape::torus && s.shape != Shape::shell;
  const int steps_max = is_convex ? 40 : 160;
  const V per_meter = hn::Div(hn::Set(d, 1.0), hn::Sqrt(dot3(dx, dy, dz, dx, dy, dz)));
  const V hit = hn::Set(d, kHit_m);
  V t = hn::Max(enter, hn::Zero(d)), t_before = t, f_before = hn::Set(d, -1.0);
  V result = hn::Set(d, kFar_m);
  for (int step = 0; step < steps_max; ++step) {
    const V f = distance_to(d, s, hn::Add(ox, hn::Mul(dx, t)), hn::Add(oy, hn::Mul(dy, t)),
                            hn::Add(oz, hn::Mul(dz, t)));
    const M done = hn::And(active, hn::Lt(f, hit));
    // The last slope closes the remaining micrometre.
    V advance = hn::Mul(f, per_meter);
    const V falling = hn::Sub(f_before, f);
    const M has_slope = hn::Gt(falling, hn::Set(d, 1e-12));
    const V secant =
        hn::Div(hn::Mul(f, hn::Sub(t, t_before)), hn::IfThenElse(has_slope, falling, hn::Set(d, 1.0)));
    const M small = hn::And(has_slope, hn::Lt(hn::Abs(secant), hn::Set(d, 1e-4)));
    result = hn::IfThenElse(done, hn::IfThenElse(small, hn::Add(t, secant), t), result);
    active = hn::AndNot(done, active);
    if (is_convex) {
      // Moving away from a convex solid, the ray never comes back to it.
      const M rising = hn::And(hn::Ge(f_before, hn::Zero(d)), hn::Ge(f, f_before));
      active = hn::AndNot(rising, active);
      advance = hn::IfThenElse(has_slope, hn::Max(advance, secant), advance);
    }
    t_before = t;
    f_before = f;
    t = hn::Add(t, advance);
    active = hn::And(active, hn::Le(t, leave));
    if (hn::AllFalse(d, active)) break;
  }
  return result;
}

double IntersectTile(const SolidInView& view, std::int64_t primitive_index, TileRays& rays) {
  const D d;
  const hn::RebindToSigned<D> di;
  const Primitive& s = *view.solid;
  const auto& m = view.R_local_camera.m;
  const V ox = hn::Set(d, view.origin_local_m.x), oy = hn::Set(d, view.origin_local_m.y),
          oz = hn::Set(d, view.origin_local_m.z);
  // A sharp box's face is the slab entered last: 1 + 2 * axis, plus 1 for the positive side.
  const auto index = hn::Set(di, primitive_index);
  const auto face_of = [&](int axis, V direction) HWY_ATTR {
    const std::int64_t negative = static_cast<std::int64_t>(1 + 2 * axis) << 16;
    const auto is_positive_side = hn::RebindMask(di, hn::Lt(direction, hn::Zero(d)));
    return hn::IfThenElse(is_positive_side, hn::Set(di, negative + (std::int64_t{1} << 16)),
                          hn::Set(di, negative));
  };
  V far = hn::Zero(d);
  for (std::size_t i = 0; i < TileRays::kCount; i += hn::Lanes(d)) {
    const V x = hn::Load(d, rays.x + i), y = hn::Load(d, rays.y + i), t = hn::Load(d, rays.t_m + i);
    const auto rotated = [&](std::size_t row) HWY_ATTR {
      return hn::Add(hn::Add(hn::Mul(hn::Set(d, m[row]), x), hn::Mul(hn::Set(d, m[row + 1]), y)),
                     hn::Set(d, m[row + 2]));
    };
    const V dx = rotated(0), dy = rotated(3), dz = rotated(6);
    V enter = hn::Set(d, -kFar_m), leave = hn::Set(d, kFar_m);
    V enter_x = enter, enter_xy = enter;
    bool is_closed_form = false;
    switch (s.shape) {
      case Shape::box:
        clip_to_slab(d, ox, dx, s.a, enter, leave);
        enter_x = enter;
        clip_to_slab(d, oy, dy, s.b, enter, leave);
        enter_xy = enter;
        clip_to_slab(d, oz, dz, s.c, enter, leave);
        is_closed_form = s.r == 0;
        break;
      case Shape::sphere:
        clip_to_round(d, ox, oy, oz, dx, dy, dz, true, s.a, enter, leave);
        is_closed_form = true;
        break;
      case Shape::cylinder:
        clip_to_round(d, ox, oy, oz, dx, dy, dz, false, s.a, enter, leave);
        clip_to_slab(d, oy, dy, s.b, enter, leave);
        is_closed_form = true;
        break;
      case Shape::capsule:
      case Shape::torus:
      case Shape::frustum:
      case Shape::shell:
        clip_to_round(d, ox, oy, oz, dx, dy, dz, false, view.solid->half_extents_m.x, enter, leave);
        clip_to_slab(d, oy, dy, view.solid->half_extents_m.y, enter, leave);
        break;
    }
    M candidate = hn::And(hn::And(hn::Le(enter, leave), hn::Lt(enter, t)), hn::Gt(leave, hn::Zero(d)));
    V nearest = t;
    if (!hn::AllFalse(d, candidate)) {
      V hit = enter;
      if (is_closed_form)
        candidate = hn::And(candidate, hn::Gt(enter, hn::Zero(d)));
      else
        hit = march(d, s, ox, oy, oz, dx, dy, dz, enter, hn::Min(leave, t), candidate);
      const M nearer = hn::And(candidate, hn::Lt(hit, t));
      nearest = hn::IfThenElse(nearer, hit, t);
      hn::Store(nearest, d, rays.t_m + i);
      auto found = index;
      if (s.shape == Shape::box && is_closed_form) {
        const auto xy =
            hn::IfThenElse(hn::RebindMask(di, hn::Gt(enter_xy, enter_x)), face_of(1, dy), face_of(0, dx));
        found =
            hn::Add(found, hn::IfThenElse(hn::RebindMask(di, hn::Gt(enter, enter_xy)), face_of(2, dz), xy));
      }
      const auto before = hn::Load(di, rays.solid + i);
      hn::Store(hn::IfThenElse(hn::RebindMask(di, nearer), found, before), di, rays.solid + i);
    }
    far = hn::Max(far, nearest);
  }
  return hn::GetLane(hn::MaxOfLanes(d, far));
}

}  // namespace HWY_NAMESPACE
}  // namespace tactus::hal::synthetic
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tactus::hal::synthetic {

HWY_EXPORT(IntersectTile);

double intersect_tile(const SolidInView& view, std::int64_t primitive_index, TileRays& rays) {
  return HWY_DYNAMIC_DISPATCH(IntersectTile)(view, primitive_index, rays);
}

}  // namespace tactus::hal::synthetic
#endif
