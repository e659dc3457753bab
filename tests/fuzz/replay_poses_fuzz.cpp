// Trajectories, pose matrices, gravity and accelerometer files: what is accepted is finite and a rotation.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "hal/replay/gravity_file.hpp"
#include "hal/replay/poses.hpp"
#include "rt/assert.hpp"

using namespace tactus;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t bytes) {
  const std::string_view text(reinterpret_cast<const char*>(data), bytes);
  const auto trajectory = hal::replay::parse_trajectory(text, "groundtruth.txt");
  for (std::size_t i = 0; i < trajectory.poses.size(); ++i) {
    const hal::TruthPose& pose = trajectory.poses[i];
    TACTUS_ASSERT(hal::replay::is_rotation(pose.T_world_depth.rotation, 1e-9));
    TACTUS_ASSERT(std::isfinite(pose.T_world_depth.translation.x) &&
                  std::isfinite(pose.T_world_depth.translation.z));
    TACTUS_ASSERT(i == 0 || trajectory.poses[i - 1].time < pose.time);
  }
  TACTUS_ASSERT((trajectory.skipped_count == 0) == trajectory.first_skip.empty());
  if (const auto pose = hal::replay::parse_pose_matrix(text, "frame-000000.pose.txt"))
    TACTUS_ASSERT(hal::replay::is_rotation(pose.value().rotation, 1e-9));
  if (const auto gravity = hal::replay::parse_gravity(text, "gravity.txt"))
    TACTUS_ASSERT(std::fabs(gravity.value().norm() - 1) < 1e-9);
  if (const auto gravity = hal::replay::gravity_from_accelerometer(text, {1'000'000'000}))
    TACTUS_ASSERT(std::fabs(gravity->norm() - 1) < 1e-9);
  return 0;
}
