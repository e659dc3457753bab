#include "hal/synthetic/trajectory.hpp"

#include <algorithm>
#include <array>

#include "hal/synthetic/deterministic_math.hpp"

namespace tactus::hal::synthetic {
namespace {

constexpr double kEase = 0.08;
constexpr int kFullLoopFrames = 300;

/// Position on the loop, 0..1, with a speed that grows linearly over the first kEase and falls over the last.
double eased(double s) {
  if (s > 0.5) return 1 - eased(1 - s);
  return s < kEase ? s * s / (2 * kEase * (1 - kEase)) : (s - kEase / 2) / (1 - kEase);
}

/// Optical axes of a camera that looks along yaw (0 = -z, positive to the left), pitch (positive up), then
/// rolls.
Rotation view_rotation(double yaw_degrees, double pitch_degrees, double roll_degrees) {
  const auto [sin_yaw, cos_yaw] = sin_cos_degrees(yaw_degrees);
  const auto [sin_pitch, cos_pitch] = sin_cos_degrees(pitch_degrees);
  const auto [sin_roll, cos_roll] = sin_cos_degrees(roll_degrees);
  const Vec3d forward{-sin_yaw * cos_pitch, sin_pitch, -cos_yaw * cos_pitch};
  const Vec3d level{cos_yaw, 0, -sin_yaw};
  const Vec3d below = forward.cross(level);
  const Vec3d right = level * cos_roll + below * sin_roll;
  const Vec3d down = below * cos_roll - level * sin_roll;
  return {{right.x, down.x, forward.x, right.y, down.y, forward.y, right.z, down.z, forward.z}};
}

/// One axis of the hand's tremor, about [-1, 1]. Every tone makes whole turns in the session, so that the
/// loop closes.
double tremor(const SyntheticOptions& options, int axis, double s, double duration_s) {
  constexpr std::array<double, 3> kTones_hz = {2.2, 3.1, 4.4};
  constexpr std::array<double, 3> kShares = {0.5, 0.3, 0.2};
  const double ramp_s = std::min(std::min(s, 1 - s) * duration_s / 0.5, 1.0);
  const double envelope = ramp_s * ramp_s * (3 - 2 * ramp_s);
  double sum = 0;
  for (std::size_t i = 0; i < kTones_hz.size(); ++i) {
    const auto whole_turns = static_cast<double>(static_cast<int>(kTones_hz[i] * duration_s + 0.5));
    const double phase =
        static_cast<double>(uniform01(hash64(options.seed * 64 + static_cast<std::uint64_t>(axis) * 8 + i)));
    sum += kShares[i] * sin_cos_turns(whole_turns * s + phase).sin;
  }
  return envelope * sum;
}

T_WorldDepth undisturbed_pose(const SyntheticOptions& options, const LoopSpec& loop, int frame_index) {
  constexpr double kTremor_m = 0.0014, kTremor_degrees = 0.14;
  double s = 0, duration_s = 0, size = 1;
  if (options.trajectory == TrajectoryKind::handheld && options.frames_count > 1) {
    const double last = options.frames_count - 1;
    // The last frame is the first one again, to the bit.
    s = frame_index >= options.frames_count - 1 ? 0 : frame_index / last;
    duration_s = last / kFrameRate_hz;
    size = std::min(1.0, last / (kFullLoopFrames - 1));
  }
  const double turns = eased(s);
  const auto [sin1, cos1] = sin_cos_turns(turns);
  const double sin2 = sin_cos_turns(2 * turns).sin;
  const auto shake = [&](int axis) { return duration_s > 0 ? tremor(options, axis, s, duration_s) : 0.0; };

  const auto [sin_yaw, cos_yaw] = sin_cos_degrees(loop.yaw_degrees);
  const double right_m = loop.right_m * size * sin1 + kTremor_m * shake(0);
  const double up_m = loop.up_m * size * sin2 + kTremor_m * shake(1);
  const double forward_m = loop.forward_m * size * (1 - cos1) / 2 + kTremor_m * shake(2);
  const Vec3d position = loop.center_world_m + Vec3d{cos_yaw * right_m - sin_yaw * forward_m, up_m,
                                                     -sin_yaw * right_m - cos_yaw * forward_m};
  // Walking right while turning right shows more of the room than circling a point.
  return {
      view_rotation(loop.yaw_degrees - loop.yaw_sweep_degrees * size * sin1 + kTremor_degrees * shake(3),
                    loop.pitch_degrees + loop.pitch_sweep_degrees * size * sin2 + kTremor_degrees * shake(4),
                    loop.roll_sweep_degrees * size * sin1 + kTremor_degrees * shake(5)),
      position};
}

}  // namespace

T_WorldDepth pose_at(const SyntheticOptions& options, const LoopSpec& loop, int frame_index) {
  const T_WorldDepth pose = undisturbed_pose(options, loop, frame_index);
  if (!options.has_jump || frame_index < options.blank_first + options.blank_count) return pose;
  const auto [s, c] = sin_cos_degrees(kJump_degrees);
  const Transform<Depth, Depth> jump{{{c, 0, s, 0, 1, 0, -s, 0, c}}, {kJump_m * 0.8, 0, -kJump_m * 0.6}};
  return pose * jump;
}

}  // namespace tactus::hal::synthetic
