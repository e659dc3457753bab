#include <cstdio>
#include <nlohmann/json.hpp>
#include <utility>

#include "firmware_host/label_scores.hpp"
#include "firmware_host/study.hpp"
#include "firmware_host/study_answer.hpp"
#include "firmware_host/study_sets.hpp"

namespace tactus::firmware {
namespace {

constexpr std::array<std::uint32_t, 7> kPeriods = {1, 2, 3, 6, 12, 24, 30};  // the paper's is 12

/// The curve's points: one in N, and by need with the rules of the settings.
std::vector<segment::KeyframeRules> points_of(const segment::KeyframeRules& rules) {
  std::vector<segment::KeyframeRules> points;
  for (const std::uint32_t period : kPeriods) {
    segment::KeyframeRules& point = points.emplace_back(rules);
    point.policy = segment::KeyframePolicy::every;
    point.every_frames = period;
  }
  points.emplace_back(rules).policy = segment::KeyframePolicy::adaptive;
  return points;
}

}  // namespace

rt::Result<std::string> study_keyframes(const StudyOptions& options) {
  auto sets = study_sets(options);
  if (!sets) return sets.error();
  nlohmann::json json_sets = nlohmann::json::object();
  std::string text;
  for (const StudySet& set : sets->sets) {
    if (!set.has_exact_truth) continue;
    text += set.name +
            "\n                 keyframes     mean IU, %     labelled   network   network + fusion    in "
            "view, while "
            "it runs    taken to map\n       N   taken   fused   fused  +crf3d    at end, %  total, ms   ms "
            "a frame   "
            "unlabelled, %  age, ms      p50, ms\n";
    for (const segment::KeyframeRules& rules : points_of(set.request.settings.profile.keyframes)) {
      LabelStudyRequest request = set.request;
      request.has_method = {false, false, false, true, true};
      request.settings.profile.keyframes = rules;
      const auto study = study_labels(request);
      if (!study) return rt::Error{study.error().code, set.name + ": " + study.error().message};
      const StudyScores scores = score(*study);
      const auto fused = evaluate::label_metrics(
                     scores[static_cast<std::size_t>(LabelMethod::fused)]->pixels.all),
                 crf = evaluate::label_metrics(
                     scores[static_cast<std::size_t>(LabelMethod::fused_crf3d)]->pixels.all);
      const double ms_per_frame =
          (study->segment_ms_total + study->fuse_ms_total) / static_cast<double>(study->frames_count);
      const bool is_adaptive = rules.policy == segment::KeyframePolicy::adaptive;
      const std::string name = is_adaptive ? "adaptive" : std::to_string(rules.every_frames);
      char line[240];
      std::snprintf(line, sizeof(line),
                    "%8s  %6llu  %6llu  %6.2f  %6.2f  %10.2f  %9.0f  %11.2f  %14.2f  %7.0f  %11.0f\n",
                    name.c_str(), static_cast<unsigned long long>(study->keyframes_taken),
                    static_cast<unsigned long long>(study->keyframes_fused), fused.mean_iu * 100,
                    crf.mean_iu * 100, fused.predicted_share * 100, study->segment_ms_total, ms_per_frame,
                    study->live_unlabelled_share * 100, study->live_label_age_ms, study->label_age_ms_p50);
      text += line;
      nlohmann::json point = {{"policy", is_adaptive ? "adaptive" : "every"},
                              {"keyframes_taken", study->keyframes_taken},
                              {"keyframes_fused", study->keyframes_fused},
                              {"mean_iu_fused", fused.mean_iu},
                              {"mean_iu_fused_crf3d", crf.mean_iu},
                              {"labelled_share", fused.predicted_share},
                              {"network_ms_total", study->segment_ms_total},
                              {"network_and_fusion_ms_per_frame", ms_per_frame},
                              {"live_unlabelled_share", study->live_unlabelled_share},
                              {"live_label_age_ms", study->live_label_age_ms},
                              {"label_age_ms_p50", study->label_age_ms_p50}};
      if (!is_adaptive) point["every_frames"] = rules.every_frames;
      json_sets[set.name].push_back(std::move(point));
    }
    text += "\n";
  }
  text +=
      "Lockstep: the network answers within its frame. A keyframe's labels take several frames to fuse (a "
      "bounded number\n"
      "of cells a frame), and one that comes meanwhile waits or is replaced: hence fewer are fused than a "
      "small N asks\n"
      "for. In view: of the surface that each frame sees, at that moment; the age is that of its block's "
      "newest label. "
      "Taken to\n"
      "map: from a keyframe to its labels. Times are of this machine as it was.\n";
  return study_answer(options, *sets, "keyframes", std::move(text), json_sets);
}

}  // namespace tactus::firmware
