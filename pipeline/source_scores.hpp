// A source's own exact labels in the form in which a network answers.
#pragma once

#include <span>

#include "hal/calibration.hpp"
#include "pipeline/label/material.hpp"
#include "pipeline/segment/material_scores.hpp"

namespace tactus {

/// Nearest pixel of a coarse grid (the size of `scores`), with the certainty of a good network: 0.9 on the
/// label, evenly everything where it is unknown. `labels` lie in the pixels of `camera`. Step, no heap.
void scores_of_labels(std::span<const MaterialId> labels, const hal::Intrinsics& camera,
                      segment::MaterialScores& scores) noexcept;

}  // namespace tactus
