// THE memory table: every byte the pipeline uses after boot, with the sum behind each count.
#pragma once

#include "hal/calibration.hpp"
#include "pipeline/profile.hpp"
#include "rt/memory_plan.hpp"

namespace tactus {

/// What of the pipeline is there this time.
struct PlanOptions {
  bool has_render = false, has_sound = false;
  bool labels_from_source = false;
  std::size_t network_bytes = 0;            // 0: no network
  int scores_width = 0, scores_height = 0;  // 0: no labels, nothing to refine
  std::size_t camera_buffers_bytes = 0;     // hal::Sensor::buffers_bytes
  std::size_t poses_bytes = 0;              // of a session of unknown length
};

/// Frames in flight: capture fills 1, 2 wait for the spine, spine 1, 1 waits for present, present 1.
inline constexpr std::size_t kFramesWaiting = 2;
inline constexpr std::size_t kFramesCount = 1 + kFramesWaiting + 1 + 1 + 1;

/// The largest region of up to wanted cells (in steps of 1024, at least 1024) that takes at most bytes_max.
/// Boot.
map::RefineConfig refine_within(const map::RefineConfig& wanted, std::uint32_t blocks_capacity,
                                std::size_t bytes_max);

/// Boot. Adds the rows, in carving order, to an empty plan.
void plan_memory(const Profile& profile, const hal::RigCalibration& rig, const PlanOptions& options,
                 rt::MemoryPlan& plan);

}  // namespace tactus
