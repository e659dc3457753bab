#include "firmware_host/label_scores.hpp"

#include <algorithm>
#include <vector>

namespace tactus::firmware {
namespace {

constexpr int kNearDistance2Max = 2;  // cells^2: 3 voxels are 1.5 cells

void score_images(const LabelStudy& study, int band_radius_px, StudyScores& scores) {
  const int width = study.camera.width, height = study.camera.height;
  std::vector<std::uint8_t> band;
  std::vector<MaterialId> common_truth;
  for (const LabelView& view : study.views) {
    band.resize(view.truth.size());
    evaluate::mark_boundary_band(view.truth, width, height, band_radius_px, band);
    common_truth = view.truth;
    for (const auto& labels : view.labels)
      for (std::size_t i = 0; i < labels.size(); ++i)
        if (labels[i] == kUnknownMaterial) common_truth[i] = kUnknownMaterial;
    const auto& net = view.labels[static_cast<std::size_t>(LabelMethod::net)];
    for (std::size_t m = 0; m < kLabelMethodsCount; ++m) {
      if (!scores[m]) continue;
      evaluate::count_pixels(view.truth, view.labels[m], band, scores[m]->pixels);
      for (std::size_t i = 0; i < common_truth.size(); ++i)
        scores[m]->common.add(common_truth[i], view.labels[m][i]);
      if (net.empty()) continue;
      for (std::size_t i = 0; i < net.size(); ++i) {
        const MaterialId label = view.labels[m][i];
        scores[m]->filled.add(view.truth[i], label == kUnknownMaterial ? net[i] : label);
      }
      scores[m]->islands.add(evaluate::wrong_islands(view.labels[m], view.truth, width, height));
    }
  }
}

void score_cells(const LabelStudy& study, StudyScores& scores) {
  std::vector<Vec3<int>> grid;
  grid.reserve(study.cells.size());
  for (const map::SurfaceCell& cell : study.cells) grid.push_back(map::grid_of(cell.address));
  const evaluate::CellIndex index(grid);
  std::vector<std::uint8_t> band(grid.size());
  evaluate::mark_boundary_cells(index, study.cell_truth, kNearDistance2Max, band);
  for (std::size_t m = 0; m < kLabelMethodsCount; ++m) {
    if (!scores[m] || study.cell_labels[m].empty()) continue;
    for (std::size_t i = 0; i < grid.size(); ++i) {
      scores[m]->cells.add(study.cell_truth[i], study.cell_labels[m][i]);
      if (band[i] != 0) scores[m]->cells_near_boundary.add(study.cell_truth[i], study.cell_labels[m][i]);
    }
    scores[m]->cell_islands = evaluate::wrong_islands(index, study.cell_labels[m], study.cell_truth);
  }
}

}  // namespace

void MethodScores::add(const MethodScores& other) {
  pixels.add(other.pixels);
  common.add(other.common);
  filled.add(other.filled);
  islands.add(other.islands);
  cells.add(other.cells);
  cells_near_boundary.add(other.cells_near_boundary);
  cell_islands.add(other.cell_islands);
}

StudyScores score(const LabelStudy& study, int band_radius_px) {
  StudyScores scores;
  for (std::size_t m = 0; m < kLabelMethodsCount; ++m)
    if (std::any_of(study.views.begin(), study.views.end(),
                    [&](const LabelView& v) { return !v.labels[m].empty(); }))
      scores[m].emplace();
  score_images(study, band_radius_px, scores);
  score_cells(study, scores);
  return scores;
}

}  // namespace tactus::firmware
