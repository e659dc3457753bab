#include <cstdio>
#include <nlohmann/json.hpp>

#include "firmware_host/label_scores.hpp"
#include "firmware_host/label_text.hpp"
#include "firmware_host/machine.hpp"
#include "firmware_host/output_file.hpp"
#include "firmware_host/paper_table.hpp"
#include "firmware_host/study.hpp"
#include "firmware_host/study_grid.hpp"
#include "firmware_host/study_sets.hpp"
#include "firmware_host/summary.hpp"

namespace tactus::firmware {
namespace {

using evaluate::LabelMetrics;

std::array<double, 4> percents(const LabelMetrics& m) {
  return {m.pixel_accuracy * 100, m.mean_accuracy * 100, m.mean_iu * 100, m.frequency_weighted_iu * 100};
}

std::string row(const std::string& name, const std::array<double, 4>& v, bool has_sign) {
  char line[160];
  std::snprintf(
      line, sizeof(line),
      has_sign ? "  %-34s %+10.2f %+10.2f %+10.2f %+10.2f\n" : "  %-34s %10.2f %10.2f %10.2f %10.2f\n",
      name.c_str(), v[0], v[1], v[2], v[3]);
  return line;
}

std::array<double, 4> minus(const std::array<double, 4>& a, const std::array<double, 4>& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2], a[3] - b[3]};
}

/// Ours, the paper's and the difference, row by row; then the steps from one method to the next.
std::string beside_paper(const StudyScores& scores) {
  std::string text = "                                      pixel acc.  mean acc.    mean IU    f.w. IU\n";
  std::array<std::array<double, 4>, kLabelMethodsCount> ours{};
  for (const PaperRow& paper : kPaperTable) {
    const auto m = static_cast<std::size_t>(paper.method);
    if (!scores[m]) continue;
    ours[m] = percents(label_metrics(scores[m]->pixels.all));
    text += row(std::string(kLabelMethodNames[m]), ours[m], false);
    text += row(std::string("  paper, ") + paper.name, paper.percent, false);
    text += row("  difference", minus(ours[m], paper.percent), true);
  }
  if (const auto m = static_cast<std::size_t>(LabelMethod::direct); scores[m])
    text += row("direct (ablation, not in the table)", percents(label_metrics(scores[m]->pixels.all)), false);
  const struct {
    const char* name;
    std::size_t from, to;  // rows of the paper's table
  } steps[] = {{"2D CRF", 0, 1}, {"fusion", 0, 2}, {"3D CRF", 2, 3}, {"all of it", 0, 3}};
  for (const auto& step : steps) {
    const PaperRow &from = kPaperTable[step.from], &to = kPaperTable[step.to];
    const auto a = static_cast<std::size_t>(from.method), b = static_cast<std::size_t>(to.method);
    if (!scores[a] || !scores[b]) continue;
    text += row(std::string("gain by ") + step.name, minus(ours[b], ours[a]), true);
    text += row("  paper", minus(to.percent, from.percent), true);
  }
  return text;
}

}  // namespace

rt::Result<std::string> study_accuracy(const StudyOptions& options) {
  auto sets = study_sets(options);
  if (!sets) return sets.error();
  if (!options.out.empty())
    if (auto made = make_study_folder(options.out); !made) return made.error();
  constexpr std::size_t kGridRows = 5;  // as in the paper
  nlohmann::json json_sets = nlohmann::json::object();
  std::string text;
  StudyScores synthetic;
  StudyGrid synthetic_grid;
  std::uint64_t synthetic_views = 0;
  std::size_t synthetic_sets = 0;
  for (const StudySet& set : sets->sets) {
    const auto study = study_labels(set.request);
    if (!study) return rt::Error{study.error().code, set.name + ": " + study.error().message};
    const StudyScores scores = score(*study);
    const bool is_synthetic = set.name.starts_with("synthetic_");
    if (is_synthetic) {
      for (std::size_t m = 0; m < kLabelMethodsCount; ++m)
        if (scores[m]) {
          if (!synthetic[m]) synthetic[m].emplace();
          synthetic[m]->add(*scores[m]);
        }
      synthetic_grid.add(*study, synthetic_sets == 0 ? (kGridRows + 1) / 2 : kGridRows / 2);
      synthetic_views += study->views.size();
      ++synthetic_sets;
    } else if (!options.out.empty()) {
      StudyGrid grid;
      grid.add(*study, kGridRows);
      if (auto wrote = grid.write(options.out / ("grid_" + set.name + ".png")); !wrote) return wrote.error();
    }
    char line[240];
    std::snprintf(line, sizeof(line), "%s: %zu frames of %llu, %s, labelled by %s; %llu frames lost\n",
                  set.name.c_str(), study->views.size(), static_cast<unsigned long long>(study->frames_count),
                  set.has_exact_truth ? "exact truth" : "truth drawn by hand", study->network.c_str(),
                  static_cast<unsigned long long>(study->frames_lost));
    text += line + crf_text(*study->crf) + scores_text(scores) +
            (set.has_exact_truth ? beside_paper(scores) : std::string()) + "\n";
    json_sets[set.name] = {
        {"source", set.request.session.source}, {"network", study->network},
        {"frames_scored", study->views.size()}, {"frames_in", study->frames_count},
        {"frames_lost", study->frames_lost},    {"keyframes_fused", study->keyframes_fused},
        {"cells", study->cells.size()},         {"crf", crf_json(*study->crf)},
        {"methods", scores_json(scores)}};
  }
  if (synthetic_sets > 0)
    text += "The synthetic rooms together, " + std::to_string(synthetic_views) +
            " frames, beside the paper's 25\n" + beside_paper(synthetic);
  for (const std::string& remark : sets->remarks) text += remark + "\n";
  if (synthetic_sets > 0)
    json_sets["synthetic"] = {{"frames_scored", synthetic_views}, {"methods", scores_json(synthetic)}};

  nlohmann::json paper = nlohmann::json::object();
  for (const PaperRow& one : kPaperTable)
    paper[std::string(kLabelMethodNames[static_cast<std::size_t>(one.method)])] = {
        {"name", one.name},
        {"pixel_accuracy", one.percent[0] / 100},
        {"mean_accuracy", one.percent[1] / 100},
        {"mean_iu", one.percent[2] / 100},
        {"frequency_weighted_iu", one.percent[3] / 100}};
  const std::string json = to_text({{"command", options.command},
                                    {"sets", json_sets},
                                    {"paper", paper},
                                    {"left_out", sets->remarks},
                                    {"revision", revision()}});
  if (!options.out.empty()) {
    if (synthetic_sets > 0)
      if (auto wrote = synthetic_grid.write(options.out / "grid_synthetic.png"); !wrote) return wrote.error();
    if (auto wrote = write_file(options.out / "accuracy.json", json); !wrote) return wrote.error();
    text += "Pictures (grid_*.png) and accuracy.json are in " + options.out.string() + "\n";
  }
  return options.is_json ? json : text;
}

}  // namespace tactus::firmware
