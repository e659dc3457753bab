#include "pipeline/render/shadow.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tactus::render {
namespace {

constexpr double kSideStepM = 0.125;
constexpr int kSamplesAcross = 80;
constexpr float kSurfaceReachM = 20;
constexpr double kMarginTexels = 4;  // stays clear, so that what lies outside the map is lit

Vec3d across(const Vec3d& direction) {
  const Vec3d least = std::fabs(direction.x) < 0.7 ? Vec3d{1, 0, 0} : Vec3d{0, 0, 1};
  return (least - direction * least.dot(direction)).normalized();
}

}  // namespace

ShadowView fit_shadow(std::span<const Caster> casters, const T_WorldDepth& T_world_depth,
                      const Vec3f& toward_world) noexcept {
  const Vec3d light = toward_world.cast<double>().normalized();
  const Vec3d x = across(light), y = light.cross(x);
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Vec3d low{kInfinity, kInfinity, kInfinity}, high{-kInfinity, -kInfinity, -kInfinity};
  for (const Caster& caster : casters) {
    const Vec3d center = T_world_depth * caster.center_depth_m.cast<double>();
    const auto radius = static_cast<double>(caster.radius_m);
    const Vec3d place{center.dot(x), center.dot(y), center.dot(light)};
    low = {std::min(low.x, place.x - radius), std::min(low.y, place.y - radius),
           std::min(low.z, place.z - radius)};
    high = {std::max(high.x, place.x + radius), std::max(high.y, place.y + radius),
            std::max(high.z, place.z + radius)};
  }
  ShadowView view;
  const Rotation R_depth_world = T_world_depth.rotation.transposed();
  view.axis_x_depth = (R_depth_world * x).cast<float>();
  view.shadow_from_depth[15] = 1;
  if (casters.empty()) return view;

  const double content_m = std::max(high.x - low.x, high.y - low.y);
  const double side_m =
      std::ceil(content_m * kShadowMapPixels / (kShadowMapPixels - 2 * kMarginTexels) / kSideStepM) *
      kSideStepM;
  const double texel_m = side_m / kShadowMapPixels;
  view.texel_m = static_cast<float>(texel_m);
  const auto corner = [&](double low_m, double high_m) {
    return std::floor(((low_m + high_m) / 2 - side_m / 2) / texel_m) * texel_m;
  };
  // The bounds plus a hundredth, so that no body touches the near plane or the cleared depth.
  const double range_m = 1.02 * (high.z - low.z), front_m = high.z + 0.01 * (high.z - low.z);
  const Vec3d& t = T_world_depth.translation;
  const auto store_row = [&view](std::size_t row, const Vec3d& direction, double offset) {
    view.shadow_from_depth[row] = static_cast<float>(direction.x);
    view.shadow_from_depth[4 + row] = static_cast<float>(direction.y);
    view.shadow_from_depth[8 + row] = static_cast<float>(direction.z);
    view.shadow_from_depth[12 + row] = static_cast<float>(offset);
  };
  store_row(0, R_depth_world * (x * (1 / side_m)), (x.dot(t) - corner(low.x, high.x)) / side_m);
  store_row(1, R_depth_world * (y * (1 / side_m)), (y.dot(t) - corner(low.y, high.y)) / side_m);
  store_row(2, R_depth_world * (light * (-1 / range_m)), (front_m - light.dot(t)) / range_m);
  return view;
}

std::size_t find_sweeps(std::span<const float> depth_m, const hal::Intrinsics& camera,
                        const Rotation& R_video_picture, const Vec3f& toward_light_depth,
                        const Vec3f& axis_x_depth, std::span<Caster> casters) noexcept {
  const Vec3f x = axis_x_depth, away = -toward_light_depth, y = toward_light_depth.cross(axis_x_depth);
  const auto in_light = [&](const Vec3f& p) { return Vec3f{p.dot(x), p.dot(y), p.dot(away)}; };
  for (Caster& caster : casters) {
    caster.place_light_m = in_light(caster.center_depth_m);
    caster.sweep_begin_m = kShadowSweepM;
    caster.sweep_end_m = -caster.radius_m;
  }
  const int step = std::max(1, camera.width / kSamplesAcross);
  const Rotation R_picture_video = R_video_picture.transposed();
  for (int v = step / 2; v < camera.height; v += step)
    for (int u = step / 2; u < camera.width; u += step) {
      const float z = depth_m[static_cast<std::size_t>(v) * static_cast<std::size_t>(camera.width) +
                              static_cast<std::size_t>(u)];
      if (!(z > 0 && z < kSurfaceReachM)) continue;
      const Vec3d ray{(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1};
      const Vec3f place = in_light((R_picture_video * ray).cast<float>() * z);
      // Points between samples: 0.7 of a step away across the sweep, up to four times that along a slanted
      // surface.
      const float spacing_m = static_cast<float>(step) * z / static_cast<float>(camera.fx);
      for (Caster& caster : casters) {
        const Vec3f offset = place - caster.place_light_m;
        const float reach_m = caster.radius_m + spacing_m;
        if (offset.x * offset.x + offset.y * offset.y > reach_m * reach_m) continue;
        if (offset.z < -caster.radius_m - spacing_m || offset.z > kShadowSweepM) continue;
        caster.sweep_begin_m = std::min(caster.sweep_begin_m, offset.z - 3 * spacing_m);
        caster.sweep_end_m = std::max(caster.sweep_end_m, offset.z + 3 * spacing_m);
      }
    }
  const auto end = std::remove_if(casters.begin(), casters.end(), [](const Caster& caster) {
    return caster.sweep_begin_m >= caster.sweep_end_m;
  });
  return static_cast<std::size_t>(end - casters.begin());
}

}  // namespace tactus::render
