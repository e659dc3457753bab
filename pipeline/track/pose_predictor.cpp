#include "pipeline/track/pose_predictor.hpp"

#include <algorithm>

#include "rt/assert.hpp"

namespace tactus::track {
namespace {

constexpr double kFrameS = 1.0 / 30;  // the unit of time here, so that sums of powers stay near 1

// Rotation vector of a rotation, by a quarter of its angle: v / (1 + w) is the axis times tan(angle / 4).
// Arctangent as a series: 1e-7 of the angle at 0.8 radians, more than four frames turn.
Vec3d rotation_vector(const Rotation& rotation) {
  const Quaternion q = rotation.quaternion();
  const Vec3d t = Vec3d{q.x, q.y, q.z} * (1 / (1 + q.w));
  const double t2 = t.dot(t);
  return t * (4 * (1 - t2 * (1.0 / 3 - t2 * (1.0 / 5 - t2 * (1.0 / 7 - t2 / 9)))));
}

Rotation rotation_of(const Vec3d& vector) {
  const Vec3d quarter = vector * 0.25;
  const double a2 = quarter.dot(quarter);
  const Vec3d t = quarter * (1 + a2 * (1.0 / 3 + a2 * (2.0 / 15 + a2 * (17.0 / 315 + a2 * (62.0 / 2835)))));
  const double t2 = t.dot(t), scale = 1 / (1 + t2);
  return Rotation::from({(1 - t2) * scale, 2 * t.x * scale, 2 * t.y * scale, 2 * t.z * scale});
}

}  // namespace

PosePredictor::PosePredictor(const PosePredictorConfig& config) : config_(config) {
  TACTUS_ASSERT(config.poses_count >= 2 && config.poses_count <= kPosesMax);
  TACTUS_ASSERT(config.decay > 0 && config.decay <= 1 && config.bend_penalty > 0);
}

void PosePredictor::push(rt::SensorTime time, const T_WorldDepth& T_world_depth) noexcept {
  if (count_ > 0) {
    const Stamped& last = poses_[0];
    const rt::Duration gap = time - last.time;
    const double shift_m = (T_world_depth.translation - last.T_world_depth.translation).norm();
    const double turn =
        rotation_vector(last.T_world_depth.rotation.transposed() * T_world_depth.rotation).norm();
    if (gap.ns <= 0 || gap > kGapMax || !(shift_m <= kShiftMaxM) || !(turn <= kTurnMax)) count_ = 0;
  }
  if (!T_world_depth.is_finite()) return;
  count_ = std::min(count_ + 1, config_.poses_count);
  for (std::size_t i = count_ - 1; i > 0; --i) poses_[i] = poses_[i - 1];
  poses_[0] = {time, T_world_depth};
}

std::optional<T_WorldDepth> PosePredictor::predict(rt::SensorTime time) const noexcept {
  if (count_ == 0) return std::nullopt;
  const Stamped& newest = poses_[0];
  if (count_ == 1) return newest.T_world_depth;
  const rt::Duration ahead = std::clamp(time - newest.time, poses_[count_ - 1].time - newest.time, kAheadMax);
  // x(t) = a + b t + c t^2 / 2 about the newest pose, weighted least squares with a penalty on c, for the
  // shift in the world and the rotation vector in the newest camera: one matrix for all six.
  double s0 = 0, s1 = 0, s2 = 0, s3 = 0, s4 = 0, weight = 1;
  std::array<Vec3d, 3> shift{}, turn{};
  const Rotation R_depth_world = newest.T_world_depth.rotation.transposed();
  for (std::size_t i = 0; i < count_; ++i) {
    const double t = (poses_[i].time - newest.time).seconds() / kFrameS, half2 = 0.5 * t * t;
    s0 += weight;
    s1 += weight * t;
    s2 += weight * t * t;
    s3 += weight * t * half2;
    s4 += weight * half2 * half2;
    const Vec3d d = poses_[i].T_world_depth.translation - newest.T_world_depth.translation;
    const Vec3d r = rotation_vector(R_depth_world * poses_[i].T_world_depth.rotation);
    const std::array<double, 3> powers{weight, weight * t, weight * half2};
    for (std::size_t k = 0; k < 3; ++k) {
      shift[k] += d * powers[k];
      turn[k] += r * powers[k];
    }
    weight *= config_.decay;
  }
  // Symmetric: rows (s0, s1, s2 / 2), (s1, s2, s3), (s2 / 2, s3, s4 + penalty); solved for the one row that
  // is asked for, the weights of the three sums in x(ahead).
  const double m02 = 0.5 * s2, m22 = s4 + config_.bend_penalty;
  const double t = ahead.seconds() / kFrameS;
  const std::array<double, 3> at{1, t, 0.5 * t * t};
  const double c00 = s2 * m22 - s3 * s3, c01 = m02 * s3 - s1 * m22, c02 = s1 * s3 - s2 * m02;
  const double c11 = s0 * m22 - m02 * m02, c12 = s1 * m02 - s0 * s3, c22 = s0 * s2 - s1 * s1;
  const double inverse = 1 / (s0 * c00 + s1 * c01 + m02 * c02);
  const std::array<double, 3> share{(c00 * at[0] + c01 * at[1] + c02 * at[2]) * inverse,
                                    (c01 * at[0] + c11 * at[1] + c12 * at[2]) * inverse,
                                    (c02 * at[0] + c12 * at[1] + c22 * at[2]) * inverse};
  Vec3d move, rotate;
  for (std::size_t k = 0; k < 3; ++k) {
    move += shift[k] * share[k];
    rotate += turn[k] * share[k];
  }
  const T_WorldDepth there{newest.T_world_depth.rotation * rotation_of(rotate),
                           newest.T_world_depth.translation + move};
  return there.orthonormalized();
}

}  // namespace tactus::track
