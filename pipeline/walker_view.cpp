#include "pipeline/walker_view.hpp"

#include <algorithm>
#include <cmath>

namespace tactus {
namespace {

constexpr double kStrideM = 0.07;  // both feet once
constexpr double kSwingM = 0.014, kLiftM = 0.009, kBobM = 0.002;
constexpr std::array<Rgb8, 2> kCoats{{{232, 120, 40}, {70, 130, 210}}};
constexpr Rgb8 kSkin{240, 205, 170}, kEyes{25, 25, 30}, kBoots{60, 45, 40};

/// A sine's wave without a library, of `turns`: 16 t (1/2 - t) over its first half.
double wave(double turns) {
  const double t = turns - std::floor(turns);
  return t < 0.5 ? 16 * t * (0.5 - t) : -16 * (t - 0.5) * (1 - t);
}

}  // namespace

std::array<render::Body, kFigureParts> drawn_figure(const interact::AgentPose& pose,
                                                    std::size_t index) noexcept {
  const Rotation R_world_agent = Rotation::from(pose.q_world_agent);
  const double turns = pose.walked_m / kStrideM;
  const double bob_m = kBobM * std::abs(wave(turns));
  std::array<render::Body, kFigureParts> parts;
  const auto part = [&](std::size_t i, render::Shape shape, Rgb8 color, Vec3d at_m, Vec3d half_m) {
    parts[i].shape = shape;
    parts[i].color = color;
    parts[i].half_extent_m = half_m.cast<float>();
    parts[i].center_world_m = pose.position_world_m + R_world_agent * at_m;
    parts[i].rotation_world_body = pose.q_world_agent;
    parts[i].roughness = 0.7F;
  };
  part(0, render::Shape::capsule, kCoats[index % kCoats.size()], {0, 0.05 + bob_m, 0}, {0.027, 0.027, 0.027});
  constexpr double kHalfTurn =
      0.70710678118654752;  // of a right angle: a capsule stands along z, the figure along y
  parts[0].rotation_world_body = pose.q_world_agent * Quaternion{kHalfTurn, -kHalfTurn, 0, 0};
  parts[0].half_length_m = 0.012F;
  part(1, render::Shape::sphere, kSkin, {0, 0.098 + bob_m, -0.003}, {0.022, 0.022, 0.022});
  for (const std::size_t side : {std::size_t{0}, std::size_t{1}}) {
    const double sign = side == 0 ? -1 : 1;
    part(2 + side, render::Shape::sphere, kEyes, {sign * 0.008, 0.102 + bob_m, -0.0225},
         {0.004, 0.004, 0.004});
    const double swing = wave(turns + 0.5 * static_cast<double>(side));
    // A foot is lifted while it swings forward, that is while its wave rises.
    const double lift = std::max(0.0, wave(turns + 0.5 * static_cast<double>(side) + 0.25));
    part(4 + side, render::Shape::box, kBoots,
         {sign * 0.015, 0.008 + kLiftM * lift, -0.004 - kSwingM * swing}, {0.011, 0.008, 0.019});
  }
  return parts;
}

}  // namespace tactus
