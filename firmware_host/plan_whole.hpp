// The memory table of the whole program, everything that may be there included.
#pragma once

#include <cstddef>

#include "hal/calibration.hpp"
#include "pipeline/profile.hpp"
#include "rt/memory_plan.hpp"

namespace tactus::firmware {

struct WholePlan {
  rt::MemoryPlan plan;
  std::size_t network_bytes = 0;  // of the network's row, which the profile's limit does not count
  /// What the profile's limit counts.
  [[nodiscard]] std::size_t without_network_bytes() const { return plan.arena_bytes() - network_bytes; }
};

/// With rendering, keyframes and their scores, and the profile's share for a network: the most that a run
/// with this profile and rig plans. `camera_buffers_bytes` as hal::Sensor has them. Boot.
WholePlan plan_whole_program(const Profile& profile, const hal::RigCalibration& rig,
                             std::size_t camera_buffers_bytes = 0);

}  // namespace tactus::firmware
