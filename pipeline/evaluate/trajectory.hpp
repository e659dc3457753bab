// How far an estimated camera path is from the true one: absolute and relative trajectory error (Sturm et al.
// 2012, "A benchmark for the evaluation of RGB-D SLAM systems", section V), after first-pose and after rigid
// alignment (Horn 1987 / Umeyama 1991, without scale). Command line and tests only: allocates, reads files.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "hal/transform.hpp"
#include "pipeline/evaluate/statistics.hpp"
#include "rt/status.hpp"
#include "rt/time.hpp"

namespace tactus::evaluate {

struct StampedPose {
  rt::SensorTime time;
  T_WorldDepth T_world_depth;
};

/// Poses in rising order of time, and what was left out while reading.
struct Trajectory {
  std::vector<StampedPose> poses;
  std::size_t rejected_count = 0;  // 7-Scenes frames whose pose is NaN, infinite or not rigid
  std::string first_rejection;     // one sentence naming the file; empty when none
};

/// Frames of a 7-Scenes folder carry a number, not a time: frame i is taken at i / 30 s.
inline constexpr std::int64_t kSevenScenesRateHz = 30;

/// TUM text: `time tx ty tz qx qy qz qw` per line (seconds, metres, camera to world), # starts a comment.
/// bad_input, with file and line, for anything else: a NaN, a rotation that is not unit to 1 %, a time not
/// later than the one before.
rt::Result<Trajectory> read_tum_trajectory(const std::filesystem::path& file);

/// `frame-NNNNNN.pose.txt` (4x4, row-major, camera to world). Text that is not 16 numbers is bad_input; a
/// NaN, infinite or non-rigid matrix (how such recordings say "no pose") is left out and counted.
rt::Result<Trajectory> read_seven_scenes_trajectory(const std::filesystem::path& folder);

/// A TUM file; or a folder with groundtruth.txt, trajectory.txt or frame-*.pose.txt.
rt::Result<Trajectory> read_trajectory(const std::filesystem::path& path);

/// One estimate and its true partner.
struct PosePair {
  StampedPose estimate, truth;
};

inline constexpr rt::Duration kAssociationMax{20'000'000};

/// Partners are nearest in time and at most `gap_max` apart; each pose is used once (the closest claim wins;
/// on a tie the earlier one). Both inputs in rising order of time; so is the answer.
std::vector<PosePair> associate(std::span<const StampedPose> estimate, std::span<const StampedPose> truth,
                                rt::Duration gap_max = kAssociationMax);

/// Maps points of the estimate's world into the truth's world.
struct Alignment {
  Rotation rotation;
  Vec3d translation;
  Vec3d operator*(const Vec3d& p) const { return rotation * p + translation; }
};

/// The alignment that makes the first pair agree exactly: errors then grow with drift, as a user sees them.
Alignment align_first_pose(std::span<const PosePair> pairs);

/// The rigid alignment that minimises the squared distance of the positions. Needs 3 pairs or more; on
/// positions that lie on a line the rotation about it is arbitrary (and without effect on the error).
Alignment align_rigid(std::span<const PosePair> pairs);

/// Distance of aligned estimated positions from the true ones, metres.
ErrorStatistics absolute_error(std::span<const PosePair> pairs, const Alignment& T_truth_estimate);

/// Error of the motion between two moments.
struct RelativeError {
  ErrorStatistics translation_m;
  ErrorStatistics rotation_deg;
};

/// Each pose with the first one at least `step` later, if that is at most 10 % more than `step` later.
RelativeError relative_error_per_time(std::span<const PosePair> pairs, rt::Duration step);
/// Each pose with the first one at least `step_m` further along the true path, if that is at most 10 %
/// further.
RelativeError relative_error_per_path(std::span<const PosePair> pairs, double step_m);

struct TrajectoryReport {
  std::size_t estimate_count = 0, truth_count = 0, pairs_count = 0;
  double duration_s = 0;     // first to last pair
  double path_length_m = 0;  // of the truth, over the pairs
  ErrorStatistics ate_first_pose_m, ate_rigid_m;
  RelativeError per_second, per_metre;
  Alignment T_truth_estimate_rigid, T_truth_estimate_first;
};

/// bad_input when fewer than 3 poses find a partner.
rt::Result<TrajectoryReport> evaluate_trajectory(std::span<const StampedPose> estimate,
                                                 std::span<const StampedPose> truth,
                                                 rt::Duration gap_max = kAssociationMax);

}  // namespace tactus::evaluate
