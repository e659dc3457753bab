#include "firmware_host/plan_whole.hpp"

#include "pipeline/memory_plan.hpp"
#include "pipeline/pipeline.hpp"

namespace tactus::firmware {

WholePlan plan_whole_program(const Profile& profile, const hal::RigCalibration& rig,
                             std::size_t camera_buffers_bytes) {
  tactus::PlanOptions options;
  options.has_render = options.has_sound = true;
  options.scores_width = options.scores_height = Pipeline::kScoresSideMax;
  options.network_bytes = profile.network_bytes;
  options.camera_buffers_bytes = camera_buffers_bytes;
  WholePlan whole;
  whole.network_bytes = profile.network_bytes;
  plan_memory(profile, rig, options, whole.plan);
  return whole;
}

}  // namespace tactus::firmware
