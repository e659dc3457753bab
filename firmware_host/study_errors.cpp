#include <cstdio>
#include <nlohmann/json.hpp>
#include <utility>

#include "firmware_host/label_scores.hpp"
#include "firmware_host/study.hpp"
#include "firmware_host/study_answer.hpp"
#include "firmware_host/study_sets.hpp"

namespace tactus::firmware {
namespace {

/// What of the system is set aside for the truth.
struct Swap {
  bool poses = false, depth = false, labels = false, fusion = false, geometry = false;
};

struct Experiment {
  const char* name;  // for JSON
  const char* what;  // for people
  Swap swap;
  int beside;  // the experiment that differs from this one by its source alone; -1: none
};

// The paper's five sources of error (sec. V-A). Exact depth is compared at true poses, since better depth
// also tracks better, and a recording may know the exact depth of some frames only, too far apart to be
// tracked.
constexpr std::array<Experiment, 7> kExperiments = {{
    {"as_is", "everything as it is", {}, -1},
    {"tracking", "1 tracking: true poses", {.poses = true}, 0},
    {"reconstruction", "2 reconstruction: exact depth at true poses", {.poses = true, .depth = true}, 1},
    {"segmentation", "3 segmentation: true labels for the network's", {.labels = true}, 0},
    {"fusion", "4 2D-3D fusion: float64, all materials", {.fusion = true}, 0},
    {"ray_cast", "5 ray-cast: points of the true surface", {.geometry = true}, 0},
    {"all_true",
     "all five",
     {.poses = true, .depth = true, .labels = true, .fusion = true, .geometry = true},
     0},
}};

double mean_iu(const StudyScores& scores, LabelMethod method) {
  return evaluate::label_metrics(scores[static_cast<std::size_t>(method)]->pixels.all).mean_iu * 100;
}

struct Measured {
  StudyScores scores;
  std::optional<FusionLoss> word_loss, map_loss;  // where fusion was swapped
};

rt::Result<Measured> run(const StudySet& set, const Swap& swap) {
  LabelStudyRequest request = set.request;
  request.has_method = {false, false, false, true, true};
  request.session.has_true_poses = swap.poses;
  request.session.has_true_depth = swap.depth;
  request.has_exact_fusion = swap.fusion;
  request.has_true_geometry = swap.geometry;
  request.crf_solver = CrfSolver::batch;  // on every line, since the incremental one cannot take float64
  if (swap.labels) request.settings.label_source = LabelSource::truth;
  const auto study = study_labels(request);
  if (!study) return rt::Error{study.error().code, set.name + ": " + study.error().message};
  return Measured{score(*study), study->word_loss, study->map_loss};
}

/// What line 4 of the table is made of.
std::string fusion_text(const FusionLoss& word, const FusionLoss& map) {
  char text[320];
  std::snprintf(
      text, sizeof(text),
      "  label words against float64: the same most probable material in %.2f %% of %llu cells, its "
      "probability\n  within %.2f in %.2f %%; as they are in the map, which fuses while its surface "
      "still moves: %.2f and %.2f %%\n",
      100 * word.winner_share(), static_cast<unsigned long long>(word.cells_count), kProbabilityNear,
      100 * word.probability_share(), 100 * map.winner_share(), 100 * map.probability_share());
  return text;
}

nlohmann::json fusion_json(const FusionLoss& loss) {
  return {{"cells", loss.cells_count},
          {"winner_equal_share", loss.winner_share()},
          {"probability_near_share", loss.probability_share()}};
}

}  // namespace

rt::Result<std::string> study_errors(const StudyOptions& options) {
  auto sets = study_sets(options);
  if (!sets) return sets.error();
  nlohmann::json json_sets = nlohmann::json::object();
  std::string text;
  for (const StudySet& set : sets->sets) {
    if (!set.has_exact_truth) continue;
    text += set.name + ", mean IU in %            fused     gain  fused_crf3d     gain\n";
    std::array<std::array<double, 2>, kExperiments.size()> iu{};
    for (std::size_t e = 0; e < kExperiments.size(); ++e) {
      const Experiment& experiment = kExperiments[e];
      auto measured = run(set, experiment.swap);
      if (!measured) return measured.error();
      const StudyScores& scores = measured->scores;
      iu[e] = {mean_iu(scores, LabelMethod::fused), mean_iu(scores, LabelMethod::fused_crf3d)};
      char line[200];
      nlohmann::json one = {{"mean_iu_fused", iu[e][0] / 100}, {"mean_iu_fused_crf3d", iu[e][1] / 100}};
      if (experiment.beside < 0) {
        std::snprintf(line, sizeof(line), "  %-46s %8.2f          %11.2f\n", experiment.what, iu[e][0],
                      iu[e][1]);
      } else {
        const auto& before = iu[static_cast<std::size_t>(experiment.beside)];
        std::snprintf(line, sizeof(line), "  %-46s %8.2f %+8.2f %12.2f %+8.2f\n", experiment.what, iu[e][0],
                      iu[e][0] - before[0], iu[e][1], iu[e][1] - before[1]);
        one["compared_with"] = kExperiments[static_cast<std::size_t>(experiment.beside)].name;
        one["gain_fused"] = (iu[e][0] - before[0]) / 100;
        one["gain_fused_crf3d"] = (iu[e][1] - before[1]) / 100;
      }
      text += line;
      if (experiment.swap.fusion && experiment.beside == 0 && !experiment.swap.poses) {
        text += fusion_text(*measured->word_loss, *measured->map_loss);
        one["label_words"] = fusion_json(*measured->word_loss);
        one["label_words_in_map"] = fusion_json(*measured->map_loss);
      }
      json_sets[set.name][experiment.name] = std::move(one);
    }
    text += "\n";
  }
  text +=
      "A source costs what swapping it for the truth gains; 2 is compared with 1, the others with the first "
      "line. True\n"
      "labels come on a 160 x 120 grid with 0.9 of certainty. A rendered bedroom knows the exact depth of "
      "one frame in\n"
      "12, so its map of line 2 is made of those alone. fused_crf3d is by the batch solver. What \"all "
      "five\" leaves is the grid of labels and "
      "of cells.\n";
  return study_answer(options, *sets, "errors", std::move(text), json_sets);
}

}  // namespace tactus::firmware
