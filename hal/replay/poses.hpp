// Poses written by others: TUM trajectories and 7-Scenes matrices. Evaluation only.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hal/camera.hpp"

namespace tactus::hal::replay {

struct Trajectory {
  std::vector<TruthPose> poses;  // times strictly increase
  std::uint64_t skipped_count = 0;
  std::string first_skip;  // "file:line: what"; empty when none
};

/// Parses "timestamp tx ty tz qx qy qz qw" lines (metres; camera to world). Lines that are not finite, whose
/// quaternion is not of unit length within 1 %, or whose time does not fit between its neighbours' are
/// skipped and counted.
Trajectory parse_trajectory(std::string_view text, std::string_view file);

/// Parses a row-major 4x4 camera-to-world matrix (metres). Error: not 16 finite numbers, or not a rigid
/// motion (rotation off by more than 1 %, last row not 0 0 0 1). Rotations that pass are made orthonormal.
rt::Result<T_WorldDepth> parse_pose_matrix(std::string_view text, std::string_view file);

/// Largest deviation of R R^T from the identity is below `tolerance` and det R > 0.
bool is_rotation(const Rotation& rotation, double tolerance);

}  // namespace tactus::hal::replay
