#include "firmware_host/label_command.hpp"

#include <cstdio>
#include <nlohmann/json.hpp>

#include "firmware_host/label_crf.hpp"
#include "firmware_host/label_outputs.hpp"
#include "firmware_host/label_scores.hpp"
#include "firmware_host/label_text.hpp"
#include "firmware_host/machine.hpp"
#include "firmware_host/summary.hpp"

namespace tactus::firmware {

rt::Result<std::string> eval_labels(const EvalLabelsOptions& options) {
  auto settings = read_settings(options.profile, options.settings);
  if (!settings) return settings.error();
  // A network is measured unless exact labels are asked for, on synthetic rooms too.
  if (settings->label_source == LabelSource::automatic) settings->label_source = LabelSource::network;
  const auto crf = crf_parameters(options.crf);
  if (!crf) return crf.error();
  LabelStudyRequest request;
  request.crf = *crf;
  request.session.source = options.source;
  request.session.frames = options.frames;
  request.session.gravity = options.gravity;
  request.session.model = options.model;
  request.settings = *settings;
  request.truth = options.truth;
  request.every = options.every;
  // A folder that cannot be written must not cost a session.
  if (!options.save_predictions.empty())
    if (auto made = make_prediction_folders(options.save_predictions, request.has_method); !made)
      return made.error();
  auto study = study_labels(request);
  if (!study) return study.error();
  if (!options.save_predictions.empty())
    if (auto saved = save_predictions(options.save_predictions, *study); !saved) return saved.error();
  if (!options.save_points.empty())
    if (auto saved = save_points(options.save_points, study->cells, study->cell_truth); !saved)
      return saved.error();
  const StudyScores scores = score(*study);

  std::uint64_t untracked_count = 0;
  for (const LabelView& view : study->views) untracked_count += view.is_tracked ? 0 : 1;
  if (options.is_json) {
    nlohmann::json names = nlohmann::json::array();
    for (const LabelView& view : study->views) names.push_back(view.name);
    return to_text({{"source", options.source},
                    {"network", study->network},
                    {"frames_in", study->frames_count},
                    {"frames_lost", study->frames_lost},
                    {"keyframes_fused", study->keyframes_fused},
                    {"frames_scored", names},
                    {"frames_scored_untracked", untracked_count},
                    {"cells", study->cells.size()},
                    {"crf", crf_json(*study->crf)},
                    {"methods", scores_json(scores)},
                    {"revision", revision()}});
  }
  char line[240];
  std::snprintf(
      line, sizeof(line), "%zu frames scored of %llu, labelled by %s; %llu keyframes fused, %zu cells\n",
      study->views.size(), static_cast<unsigned long long>(study->frames_count), study->network.c_str(),
      static_cast<unsigned long long>(study->keyframes_fused), study->cells.size());
  std::string text = line;
  if (untracked_count > 0)
    text += std::to_string(untracked_count) +
            " of the scored frames were not tracked: the map's methods know nothing there, which counts as "
            "missed\n";
  text += crf_text(*study->crf);
  text += scores_text(scores);
  if (options.has_confusion)
    for (std::size_t m = 0; m < kLabelMethodsCount; ++m)
      if (scores[m]) text += std::string(kLabelMethodNames[m]) + "\n" + confusion_text(scores[m]->pixels.all);
  return text;
}

}  // namespace tactus::firmware
