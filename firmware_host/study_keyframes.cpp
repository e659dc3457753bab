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

}  // namespace

rt::Result<std::string> study_keyframes(const StudyOptions& options) {
  auto sets = study_sets(options);
  if (!sets) return sets.error();
  nlohmann::json json_sets = nlohmann::json::object();
  std::string text;
  for (const StudySet& set : sets->sets) {
    if (!set.has_exact_truth) continue;
    text +=
        set.name +
        "\n   N  keyframes fused  mean IU, %: fused  fused_crf3d  labelled, %  network + fusion, ms a frame  "
        "label age p50, ms\n";
    for (const std::uint32_t period : kPeriods) {
      LabelStudyRequest request = set.request;
      request.has_method = {false, false, false, true, true};
      request.settings.profile.keyframe_every_frames = period;
      const auto study = study_labels(request);
      if (!study) return rt::Error{study.error().code, set.name + ": " + study.error().message};
      const StudyScores scores = score(*study);
      const auto fused = evaluate::label_metrics(
                     scores[static_cast<std::size_t>(LabelMethod::fused)]->pixels.all),
                 crf = evaluate::label_metrics(
                     scores[static_cast<std::size_t>(LabelMethod::fused_crf3d)]->pixels.all);
      const double ms_per_frame =
          (study->segment_ms_total + study->fuse_ms_total) / static_cast<double>(study->frames_count);
      char line[200];
      std::snprintf(line, sizeof(line), "  %2u  %15llu  %17.2f  %11.2f  %11.2f  %28.2f  %17.0f\n", period,
                    static_cast<unsigned long long>(study->keyframes_fused), fused.mean_iu * 100,
                    crf.mean_iu * 100, fused.predicted_share * 100, ms_per_frame, study->label_age_ms_p50);
      text += line;
      json_sets[set.name].push_back({{"every_frames", period},
                                     {"keyframes_fused", study->keyframes_fused},
                                     {"mean_iu_fused", fused.mean_iu},
                                     {"mean_iu_fused_crf3d", crf.mean_iu},
                                     {"labelled_share", fused.predicted_share},
                                     {"network_and_fusion_ms_per_frame", ms_per_frame},
                                     {"label_age_ms_p50", study->label_age_ms_p50}});
    }
    text += "\n";
  }
  text +=
      "Lockstep: the network answers within its frame. A keyframe's labels take several frames to fuse (a "
      "bounded number\n"
      "of cells a frame), and one that comes meanwhile waits or is replaced: hence fewer are fused than a "
      "small N asks\n"
      "for. The age is that of a keyframe when its labels are in the map. Times are of this machine as it "
      "was.\n";
  return study_answer(options, *sets, "keyframes", std::move(text), json_sets);
}

}  // namespace tactus::firmware
