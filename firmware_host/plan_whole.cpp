#include "firmware_host/plan_whole.hpp"

#include "pipeline/memory_plan.hpp"
#include "pipeline/pipeline.hpp"

namespace tactus::firmware {

WholePlan plan_whole_program(const Profile& profile, const hal::RigCalibration& rig) {
  tactus::PlanOptions options;
  options.has_render = true;
  options.scores_width = Pipeline::kSourceScoresWidth;
  options.scores_height = Pipeline::kSourceScoresHeight;
  options.network_bytes = profile.network_bytes;
  return {plan_memory(profile, rig, options), profile.network_bytes};
}

}  // namespace tactus::firmware
