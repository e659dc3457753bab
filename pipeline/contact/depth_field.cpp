#include "pipeline/contact/depth_field.hpp"

#include <algorithm>
#include <cmath>

namespace tactus::contact {
namespace {

constexpr double kNeighborM = 0.015;    // farther than a pixel's noise, nearer than most things are wide
constexpr double kEdgeM = 0.03;         // a larger step between neighbours is the edge of something
constexpr double kSameSurfaceM = 0.01;  // off the first guess: three sigma of a depth camera at 3 m
constexpr double kNearestZM = 0.05;

/// Inverse depth at a pixel, 1/m; 0 where nothing was measured.
double inverse_depth(const DepthView& view, int u, int v) {
  if (u < 0 || v < 0 || u >= view.camera.width || v >= view.camera.height) return 0;
  const std::size_t at =
      static_cast<std::size_t>(v) * static_cast<std::size_t>(view.camera.width) + static_cast<std::size_t>(u);
  const double z_m = view.raw_depth[at] * view.depth_m_per_unit;
  return z_m > kNearestZM ? 1 / z_m : 0;
}

/// Change of inverse depth a pixel along one axis of the image, from the neighbours before and behind.
struct Slope {
  double per_pixel = 0;
  bool known = false;
};

Slope slope_of(double before, double here, double behind, int pixels) {
  const double to_m = 1 / (here * here);  // of a difference of inverse depths
  const double bend_m = std::abs(0.5 * (before + behind) - here) * to_m;
  if (before > 0 && behind > 0 && bend_m < 0.5 * kEdgeM) return {(behind - before) / (2.0 * pixels), true};
  const double step_before = before > 0 ? std::abs(here - before) * to_m : 1;
  const double step_behind = behind > 0 ? std::abs(behind - here) * to_m : 1;
  if (std::min(step_before, step_behind) > kEdgeM) return {};
  return {(step_before < step_behind ? here - before : behind - here) / pixels, true};
}

/// Inverse depth around a pixel: value there and change a pixel.
struct InversePlane {
  double here = 0, across = 0, down = 0;
};

/// Least squares over 5 x 5 pixels of those that lie within kSameSurfaceM of the first guess: a single
/// pixel's noise would tip the plane by degrees.
InversePlane fit(const DepthView& view, int column, int row, int pixels, const InversePlane& guess) {
  const double to_m = 1 / (guess.here * guess.here);
  double n = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0, e = 0, ex = 0, ey = 0;
  for (int j = -2; j <= 2; ++j)
    for (int i = -2; i <= 2; ++i) {
      const int du = i * pixels / 2, dv = j * pixels / 2;
      const double w = inverse_depth(view, column + du, row + dv);
      const double off = w - (guess.here + guess.across * du + guess.down * dv);
      if (w == 0 || std::abs(off) * to_m > kSameSurfaceM) continue;
      n += 1;
      x += du;
      y += dv;
      xx += du * du;
      xy += du * dv;
      yy += dv * dv;
      e += off;
      ex += off * du;
      ey += off * dv;
    }
  // Normal equations about the means.
  const double mx = x / n, my = y / n, me = e / n;
  const double cxx = xx / n - mx * mx, cxy = xy / n - mx * my, cyy = yy / n - my * my;
  const double cex = ex / n - me * mx, cey = ey / n - me * my;
  const double det = cxx * cyy - cxy * cxy;
  if (n < 6 || det < 0.02 * (cxx + cyy) * (cxx + cyy)) return guess;  // nearly a line of pixels
  const double a = (cex * cyy - cey * cxy) / det, b = (cey * cxx - cex * cxy) / det;
  return {guess.here + me - a * mx - b * my, guess.across + a, guess.down + b};
}

}  // namespace

bool sample_depth(const DepthView& view, double truncation_m, const Vec3d& p_world,
                  map::DistanceSample& out) noexcept {
  if (!view.is_valid) return false;
  const hal::Intrinsics& camera = view.camera;
  const Vec3d p = view.T_world_depth.rotation.transposed() * (p_world - view.T_world_depth.translation);
  if (p.z < kNearestZM) return false;
  const double u = camera.fx * p.x / p.z + camera.cx, v = camera.fy * p.y / p.z + camera.cy;
  if (!(u >= 0 && v >= 0 && u < camera.width - 0.5 && v < camera.height - 0.5)) return false;
  const int column = static_cast<int>(u + 0.5), row = static_cast<int>(v + 0.5);
  const double here = inverse_depth(view, column, row);
  if (here == 0) return false;

  // Surfaces are seen at up to 80 degrees: what is six times as far along the ray is outside the band.
  const double gap_m = 1 / here - p.z;
  if (gap_m < -6 * truncation_m) return false;
  if (gap_m > 6 * truncation_m) {
    out.distance_m = static_cast<float>(truncation_m);
    out.gradient = {};
    return true;
  }

  const int pixels = std::clamp(static_cast<int>(kNeighborM * camera.fx * here + 0.5), 2, 16);
  const Slope across = slope_of(inverse_depth(view, column - pixels, row), here,
                                inverse_depth(view, column + pixels, row), pixels);
  const Slope down = slope_of(inverse_depth(view, column, row - pixels), here,
                              inverse_depth(view, column, row + pixels), pixels);
  if (!across.known || !down.known) return false;
  const InversePlane surface = fit(view, column, row, pixels, {here, across.per_pixel, down.per_pixel});

  // The plane n.P = d has 1/z = (n/d).ray: its coefficients are the slopes of the inverse depth.
  const Vec3d plane{surface.across * camera.fx, surface.down * camera.fy,
                    surface.here - surface.across * (column - camera.cx) - surface.down * (row - camera.cy)};
  const double length = plane.norm();
  const double distance_m = (1 - plane.dot(p)) / length;
  if (distance_m < -truncation_m) return false;
  out.distance_m = static_cast<float>(std::min(distance_m, truncation_m));
  out.gradient = (view.T_world_depth.rotation * (plane * (-1 / length))).cast<float>();
  return true;
}

DistanceField DepthBackedField::field() const noexcept {
  DistanceField field;
  field.context = this;
  field.truncation_m = map_.truncation_m;
  field.slope_max = map_.slope_max;
  field.sample_fn = [](const void* context, const Vec3f& p, map::DistanceSample& out) noexcept {
    const auto& self = *static_cast<const DepthBackedField*>(context);
    return self.map_.sample_fn(self.map_.context, p, out) ||
           sample_depth(*self.view_, static_cast<double>(self.map_.truncation_m), p.cast<double>(), out);
  };
  field.distances_fn = [](const void* context, std::span<const Vec3f> points, std::span<float> out) noexcept {
    const auto& self = *static_cast<const DepthBackedField*>(context);
    self.map_.distances(points, out);
    const double truncation_m = static_cast<double>(self.map_.truncation_m);
    for (std::size_t i = 0; i < points.size(); ++i) {
      map::DistanceSample both;
      if (out[i] == map::kUnknownDistanceM &&
          sample_depth(*self.view_, truncation_m, points[i].cast<double>(), both))
        out[i] = both.distance_m;
    }
  };
  field.materials_fn = [](const void* context, const Vec3f& p, MaterialDistribution& out) noexcept {
    const auto& self = *static_cast<const DepthBackedField*>(context);
    return self.map_.materials_fn(self.map_.context, p, out);
  };
  field.raycast_fn = [](const void* context, const Vec3f& origin, const Vec3f& direction, float range_m,
                        map::SurfacePoint& out) noexcept {
    const DistanceField& map = static_cast<const DepthBackedField*>(context)->map_;
    return map.raycast_fn != nullptr && map.raycast_fn(map.context, origin, direction, range_m, out);
  };
  return field;
}

}  // namespace tactus::contact
