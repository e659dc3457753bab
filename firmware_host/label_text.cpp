#include "firmware_host/label_text.hpp"

#include <cstdio>
#include <nlohmann/json.hpp>
#include <vector>

#include "firmware_host/eval_label_metrics.hpp"

namespace tactus::firmware {
namespace {

using evaluate::ConfusionMatrix;
using evaluate::LabelMetrics;

std::string metrics_line(std::string_view name, const LabelMetrics& m) {
  char line[160];
  std::snprintf(line, sizeof(line), "  %-12s %10.2f %10.2f %10.2f %10.2f %12.2f\n", std::string(name).c_str(),
                m.pixel_accuracy * 100, m.mean_accuracy * 100, m.mean_iu * 100, m.frequency_weighted_iu * 100,
                m.predicted_share * 100);
  return line;
}

/// A table of one confusion per method; nothing when nothing was counted.
template <typename Pick>
std::string metrics_table(const char* title, const StudyScores& scores, const Pick& pick) {
  std::string lines;
  std::uint64_t pixels_count = 0;
  int classes_count = 0;
  for (std::size_t m = 0; m < kLabelMethodsCount; ++m) {
    if (!scores[m]) continue;
    const LabelMetrics metrics = evaluate::label_metrics(pick(*scores[m]));
    if (metrics.pixels_count == 0) continue;
    pixels_count = metrics.pixels_count;
    classes_count = metrics.classes_count;
    lines += metrics_line(kLabelMethodNames[m], metrics);
  }
  if (lines.empty()) return {};
  char heading[240];
  std::snprintf(heading, sizeof(heading),
                "%s: %llu, of %d materials\n                pixel acc.  mean acc.    mean IU    f.w. IU  "
                "predicted, %%\n",
                title, static_cast<unsigned long long>(pixels_count), classes_count);
  return heading + lines;
}

double agreement(const CrfOutcome& crf) {
  return crf.cells_count == 0 ? 1
                              : static_cast<double>(crf.equal_count) / static_cast<double>(crf.cells_count);
}

}  // namespace

std::string crf_text(const CrfOutcome& crf) {
  if (crf.solver == CrfSolver::batch)
    return "3D CRF: the batch solver over the finished map" +
           (crf.why_batch.empty() ? std::string(".") : ", since " + crf.why_batch) + "\n";
  const double share = agreement(crf);
  char line[320];
  std::snprintf(line, sizeof(line),
                "3D CRF: the incremental solver, as the product runs it (%llu regions prepared); the batch "
                "solver over the finished map finds the same material in %.2f %% of %llu cells.\n",
                static_cast<unsigned long long>(crf.regions_count), 100 * share,
                static_cast<unsigned long long>(crf.cells_count));
  std::string text = line;
  if (share < kCrfAgreementMin)
    text +=
        "That is less than the 99 % required: fused_crf3d below is what the product says, and not what the "
        "field of eq. (2) says.\n";
  return text;
}

nlohmann::json crf_json(const CrfOutcome& crf) {
  nlohmann::json json = {{"solver", crf.solver == CrfSolver::incremental ? "incremental" : "batch"}};
  if (!crf.why_batch.empty()) json["why_batch"] = crf.why_batch;
  if (crf.solver == CrfSolver::incremental) {
    json["cells_compared"] = crf.cells_count;
    json["agreement_with_batch"] = agreement(crf);
    json["regions"] = crf.regions_count;
  }
  return json;
}

std::string scores_text(const StudyScores& scores) {
  std::string text = metrics_table("All pixels with a known truth", scores,
                                   [](const MethodScores& s) { return s.pixels.all; });
  text += metrics_table("Pixels that every method labels", scores,
                        [](const MethodScores& s) { return s.common; });
  text += metrics_table("All pixels, those without a labelled surface as the network has them", scores,
                        [](const MethodScores& s) { return s.filled; });
  text += metrics_table("Pixels near a boundary of the truth", scores,
                        [](const MethodScores& s) { return s.pixels.band; });
  text += metrics_table("Pixels away from boundaries", scores,
                        [](const MethodScores& s) { return s.pixels.inside; });
  text += metrics_table("Cells of the map seen by a scored frame", scores,
                        [](const MethodScores& s) { return s.cells; });
  text +=
      "Small wrong islands (fewer than 50), and cells wrong within 3 voxels of a boundary of the truth\n"
      "                  in images   pixels in   in the map    cells in  wrong near, %\n";
  for (std::size_t m = 0; m < kLabelMethodsCount; ++m) {
    if (!scores[m]) continue;
    const MethodScores& s = *scores[m];
    char line[160];
    std::snprintf(line, sizeof(line), "  %-12s %12llu %11llu", std::string(kLabelMethodNames[m]).c_str(),
                  static_cast<unsigned long long>(s.islands.islands_count),
                  static_cast<unsigned long long>(s.islands.members_count));
    text += line;
    const LabelMetrics near = evaluate::label_metrics(s.cells_near_boundary);
    if (near.pixels_count > 0) {
      std::snprintf(line, sizeof(line), " %12llu %11llu %14.2f",
                    static_cast<unsigned long long>(s.cell_islands.islands_count),
                    static_cast<unsigned long long>(s.cell_islands.members_count),
                    (1 - near.pixel_accuracy) * 100);
      text += line;
    }
    text += "\n";
  }
  return text;
}

std::string confusion_text(const ConfusionMatrix& confusion) {
  std::vector<std::size_t> rows, columns;
  for (std::size_t i = 0; i < kMaterialCount; ++i) {
    std::uint64_t row = confusion.unknown_count(i), column = 0;
    for (std::size_t j = 0; j < kMaterialCount; ++j) {
      row += confusion.count(i, j);
      column += confusion.count(j, i);
    }
    if (row > 0) rows.push_back(i);
    if (row + column > 0) columns.push_back(i);
  }
  char word[64];
  std::string text = "  true \\ taken for, %   ";
  for (const std::size_t j : columns) {
    std::snprintf(word, sizeof(word), " %6.6s", std::string(kMaterialNames[j]).c_str());
    text += word;
  }
  text += "   none      pixels\n";
  for (const std::size_t i : rows) {
    std::uint64_t row = confusion.unknown_count(i);
    for (std::size_t j = 0; j < kMaterialCount; ++j) row += confusion.count(i, j);
    const double to_percent = 100.0 / static_cast<double>(row);
    std::snprintf(word, sizeof(word), "  %-22s", std::string(kMaterialNames[i]).c_str());
    text += word;
    for (const std::size_t j : columns) {
      std::snprintf(word, sizeof(word), " %6.1f", static_cast<double>(confusion.count(i, j)) * to_percent);
      text += word;
    }
    std::snprintf(word, sizeof(word), " %6.1f %11llu\n",
                  static_cast<double>(confusion.unknown_count(i)) * to_percent,
                  static_cast<unsigned long long>(row));
    text += word;
  }
  return text;
}

nlohmann::json scores_json(const StudyScores& scores) {
  nlohmann::json methods = nlohmann::json::object();
  for (std::size_t m = 0; m < kLabelMethodsCount; ++m) {
    if (!scores[m]) continue;
    const MethodScores& s = *scores[m];
    nlohmann::json one = {{"pixels", metrics_json(label_metrics(s.pixels.all))},
                          {"common", metrics_json(label_metrics(s.common))},
                          {"filled", metrics_json(label_metrics(s.filled))},
                          {"near_boundary", metrics_json(label_metrics(s.pixels.band))},
                          {"away_from_boundary", metrics_json(label_metrics(s.pixels.inside))},
                          {"wrong_islands", s.islands.islands_count},
                          {"wrong_islands_pixels", s.islands.members_count}};
    const LabelMetrics near = evaluate::label_metrics(s.cells_near_boundary);
    if (near.pixels_count > 0) {
      one["cells"] = metrics_json(label_metrics(s.cells));
      one["cells"]["wrong_islands"] = s.cell_islands.islands_count;
      one["cells"]["wrong_islands_cells"] = s.cell_islands.members_count;
      one["cells"]["wrong_near_boundary_share"] = 1 - near.pixel_accuracy;
    }
    methods[std::string(kLabelMethodNames[m])] = std::move(one);
  }
  return methods;
}

}  // namespace tactus::firmware
