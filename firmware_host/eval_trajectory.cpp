#include <cmath>
#include <nlohmann/json.hpp>

#include "firmware_host/commands.hpp"
#include "firmware_host/eval_text.hpp"
#include "firmware_host/summary.hpp"
#include "pipeline/evaluate/trajectory.hpp"

namespace tactus::firmware {

rt::Result<std::string> eval_trajectory(const EvalTrajectoryOptions& options) {
  if (!(options.gap_ms_max > 0 && options.gap_ms_max <= 1e6)) {
    return rt::Error{rt::ExitCode::bad_usage, "--gap: a time above 0 and up to 1000000 ms is needed."};
  }
  auto estimate = evaluate::read_trajectory(options.estimate);
  if (!estimate) return estimate.error();
  auto truth = evaluate::read_trajectory(options.truth);
  if (!truth) return truth.error();
  const rt::Duration gap_max{std::llround(options.gap_ms_max * 1e6)};
  auto evaluated = evaluate::evaluate_trajectory(estimate->poses, truth->poses, gap_max);
  if (!evaluated) {
    return rt::Error{evaluated.error().code, options.estimate.string() + " against " +
                                                 options.truth.string() + ": " + evaluated.error().message};
  }
  const evaluate::TrajectoryReport& r = *evaluated;
  if (options.is_json) {
    return to_text({{"estimate", options.estimate.string()},
                    {"truth", options.truth.string()},
                    {"poses", r.estimate_count},
                    {"pairs", r.pairs_count},
                    {"truth_poses_rejected", truth->rejected_count},
                    {"duration_s", r.duration_s},
                    {"path_length_m", r.path_length_m},
                    {"ate_first_pose_mm", statistics_json(r.ate_first_pose_m, 1e3)},
                    {"ate_rigid_mm", statistics_json(r.ate_rigid_m, 1e3)},
                    {"rpe_per_second_mm", statistics_json(r.per_second.translation_m, 1e3)},
                    {"rpe_per_second_deg", statistics_json(r.per_second.rotation_deg, 1)},
                    {"rpe_per_metre_mm", statistics_json(r.per_metre.translation_m, 1e3)},
                    {"rpe_per_metre_deg", statistics_json(r.per_metre.rotation_deg, 1)}});
  }
  std::string text = kStatisticsHeading;
  text += statistics_line("ATE, aligned at the first pose, mm", r.ate_first_pose_m, 1e3);
  text += statistics_line("ATE, rigidly aligned, mm", r.ate_rigid_m, 1e3);
  const auto relative = [&](const evaluate::RelativeError& e, const std::string& step) {
    if (e.translation_m.count == 0) {
      text += "RPE per " + step + ": the recording is too short for it\n";
      return;
    }
    text += statistics_line(("RPE per " + step + ", mm").c_str(), e.translation_m, 1e3);
    text += statistics_line(("RPE per " + step + ", degrees").c_str(), e.rotation_deg, 1);
  };
  relative(r.per_second, "second");
  relative(r.per_metre, "metre");
  char line[200];
  std::snprintf(line, sizeof(line),
                "%zu of %zu estimated poses have a true pose within %g ms; %.2f s, %.2f m of true path\n",
                r.pairs_count, r.estimate_count, options.gap_ms_max, r.duration_s, r.path_length_m);
  text += line;
  for (const evaluate::Trajectory* t : {&*estimate, &*truth})
    if (t->rejected_count > 0)
      text += std::to_string(t->rejected_count) + " poses were left out: " + t->first_rejection + "\n";
  return text;
}

}  // namespace tactus::firmware
