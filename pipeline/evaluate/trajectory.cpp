#include "pipeline/evaluate/trajectory.hpp"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <numbers>
#include <optional>

namespace tactus::evaluate {
namespace {

double angle_deg(const Rotation& r) {
  const Quaternion q = r.quaternion();
  const double sine = std::sqrt(q.x * q.x + q.y * q.y + q.z * q.z);
  return 2 * std::atan2(sine, std::abs(q.w)) * 180 / std::numbers::pi;
}

/// Index pairs (i, j) of the motions to compare -> the two error lists.
template <typename Distance>
RelativeError relative_error(std::span<const PosePair> pairs, double step, const Distance& position) {
  constexpr double kSlack = 1.1;
  std::vector<double> translations_m, rotations_deg;
  std::size_t j = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    j = std::max(j, i + 1);
    while (j < pairs.size() && position(j) - position(i) < step) ++j;
    if (j == pairs.size()) break;
    if (position(j) - position(i) > step * kSlack) continue;
    const auto motion_truth = pairs[i].truth.T_world_depth.inverse() * pairs[j].truth.T_world_depth;
    const auto motion_estimate = pairs[i].estimate.T_world_depth.inverse() * pairs[j].estimate.T_world_depth;
    const auto difference = motion_truth.inverse() * motion_estimate;
    translations_m.push_back(difference.translation.norm());
    rotations_deg.push_back(angle_deg(difference.rotation));
  }
  return {statistics(translations_m), statistics(rotations_deg)};
}

std::vector<double> path_along_truth(std::span<const PosePair> pairs) {
  std::vector<double> path_m(pairs.size(), 0.0);
  for (std::size_t i = 1; i < pairs.size(); ++i) {
    path_m[i] =
        path_m[i - 1] +
        (pairs[i].truth.T_world_depth.translation - pairs[i - 1].truth.T_world_depth.translation).norm();
  }
  return path_m;
}

}  // namespace

std::vector<PosePair> associate(std::span<const StampedPose> estimate, std::span<const StampedPose> truth,
                                rt::Duration gap_max) {
  std::vector<PosePair> pairs;
  std::size_t nearest = 0;
  std::size_t last_used = truth.size();
  const auto gap_ns = [&](std::size_t t, rt::SensorTime time) { return std::abs((truth[t].time - time).ns); };
  for (const StampedPose& pose : estimate) {
    if (truth.empty()) break;
    while (nearest + 1 < truth.size() && gap_ns(nearest + 1, pose.time) < gap_ns(nearest, pose.time))
      ++nearest;
    const std::int64_t gap = gap_ns(nearest, pose.time);
    if (gap > gap_max.ns) continue;
    if (nearest == last_used) {
      if (gap < gap_ns(nearest, pairs.back().estimate.time)) pairs.back().estimate = pose;
      continue;
    }
    pairs.push_back({pose, truth[nearest]});
    last_used = nearest;
  }
  return pairs;
}

Alignment align_first_pose(std::span<const PosePair> pairs) {
  TACTUS_ASSERT(!pairs.empty());
  const T_WorldDepth& truth = pairs[0].truth.T_world_depth;
  const Transform<Depth, World> T_depth_estimate = pairs[0].estimate.T_world_depth.inverse();
  return {truth.rotation * T_depth_estimate.rotation, truth * T_depth_estimate.translation};
}

Alignment align_rigid(std::span<const PosePair> pairs) {
  TACTUS_ASSERT(pairs.size() >= 3);
  const auto n = static_cast<Eigen::Index>(pairs.size());
  Eigen::Matrix3Xd from(3, n), to(3, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Vec3d& e = pairs[static_cast<std::size_t>(i)].estimate.T_world_depth.translation;
    const Vec3d& t = pairs[static_cast<std::size_t>(i)].truth.T_world_depth.translation;
    from.col(i) << e.x, e.y, e.z;
    to.col(i) << t.x, t.y, t.z;
  }
  const Eigen::Matrix4d T = Eigen::umeyama(from, to, false);
  Alignment a;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column)
      a.rotation.m[static_cast<std::size_t>(row * 3 + column)] = T(row, column);
  a.translation = {T(0, 3), T(1, 3), T(2, 3)};
  return a;
}

ErrorStatistics absolute_error(std::span<const PosePair> pairs, const Alignment& T_truth_estimate) {
  std::vector<double> errors_m;
  errors_m.reserve(pairs.size());
  for (const PosePair& pair : pairs) {
    const Vec3d aligned = T_truth_estimate * pair.estimate.T_world_depth.translation;
    errors_m.push_back((aligned - pair.truth.T_world_depth.translation).norm());
  }
  return statistics(errors_m);
}

RelativeError relative_error_per_time(std::span<const PosePair> pairs, rt::Duration step) {
  return relative_error(pairs, step.seconds(),
                        [&](std::size_t i) { return (pairs[i].truth.time - pairs[0].truth.time).seconds(); });
}

RelativeError relative_error_per_path(std::span<const PosePair> pairs, double step_m) {
  const std::vector<double> path_m = path_along_truth(pairs);
  return relative_error(pairs, step_m, [&](std::size_t i) { return path_m[i]; });
}

rt::Result<TrajectoryReport> evaluate_trajectory(std::span<const StampedPose> estimate,
                                                 std::span<const StampedPose> truth, rt::Duration gap_max) {
  const std::vector<PosePair> pairs = associate(estimate, truth, gap_max);
  if (pairs.size() < 3) {
    std::string why = "only " + std::to_string(pairs.size()) + " of " + std::to_string(estimate.size()) +
                      " estimated poses have a true pose within " + std::to_string(gap_max.ns / 1'000'000) +
                      " ms; 3 are needed.";
    if (!estimate.empty() && !truth.empty() &&
        (estimate.back().time < truth.front().time || truth.back().time < estimate.front().time)) {
      why += " The two do not overlap in time: estimate " + std::to_string(estimate.front().time.seconds()) +
             " to " + std::to_string(estimate.back().time.seconds()) + " s, truth " +
             std::to_string(truth.front().time.seconds()) + " to " +
             std::to_string(truth.back().time.seconds()) + " s.";
    }
    return rt::Error{rt::ExitCode::bad_input, why};
  }
  TrajectoryReport report;
  report.estimate_count = estimate.size();
  report.truth_count = truth.size();
  report.pairs_count = pairs.size();
  report.duration_s = (pairs.back().truth.time - pairs.front().truth.time).seconds();
  report.path_length_m = path_along_truth(pairs).back();
  report.T_truth_estimate_first = align_first_pose(pairs);
  report.T_truth_estimate_rigid = align_rigid(pairs);
  report.ate_first_pose_m = absolute_error(pairs, report.T_truth_estimate_first);
  report.ate_rigid_m = absolute_error(pairs, report.T_truth_estimate_rigid);
  report.per_second = relative_error_per_time(pairs, rt::Duration{1'000'000'000});
  report.per_metre = relative_error_per_path(pairs, 1.0);
  return report;
}

}  // namespace tactus::evaluate
