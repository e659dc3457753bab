// From label images to figures: the metrics of each method of a study.
#pragma once

#include <array>
#include <optional>

#include "firmware_host/label_methods.hpp"
#include "pipeline/evaluate/islands.hpp"
#include "pipeline/evaluate/trimap.hpp"

namespace tactus::firmware {

struct MethodScores {
  evaluate::TrimapConfusion pixels;  // every pixel of known truth; no prediction is a miss
  evaluate::ConfusionMatrix common;  // pixels that every method of the study labels
  evaluate::ConfusionMatrix filled;  // as `pixels`, holes of the map filled with the frame's own `net`
  evaluate::IslandCount islands;     // in the images
  // Of the methods of the map, over cells of known truth.
  evaluate::ConfusionMatrix cells, cells_near_boundary;  // within 3 voxels of a cell of another truth
  evaluate::IslandCount cell_islands;
  void add(const MethodScores& other);
};

/// Scores by method; nothing for methods that were not run.
using StudyScores = std::array<std::optional<MethodScores>, kLabelMethodsCount>;

/// `band_radius_px`: of the trimap.
StudyScores score(const LabelStudy& study, int band_radius_px = evaluate::kTrimapRadius_px);

}  // namespace tactus::firmware
