// Measures what the CRF does to labelled points, sweeps each of its parameters, and fits them by coordinate
// descent.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "pipeline/evaluate/labels.hpp"
#include "pipeline/label/crf/crf.hpp"
#include "rt/status.hpp"
#include "tests/bench/crf_points_file.hpp"

namespace tactus::bench {

/// The four metrics of the most probable materials, and how probable the true ones were (mean over scored
/// points).
struct CrfScore {
  evaluate::LabelMetrics metrics;
  double mean_truth_probability = 0;
};

/// By the unary costs alone.
CrfScore score_unary(std::span<const LabelledPoints> rooms);

/// After the batch CRF, all rooms counted into one confusion matrix. Error (bad_input): a room that the
/// solver refuses.
rt::Result<CrfScore> score_crf(std::span<const LabelledPoints> rooms, const label::CrfParameters& parameters);

/// The eight weights and bandwidths of eq. (3), by name.
struct CrfKnob {
  const char* name;  // as in the settings file: "appearance.theta_color"
  float& (*value)(label::CrfParameters&);
  /// Where the fit goes, other than to a weight of 0. Heavier weights leave nothing of what was observed.
  /// Narrower bandwidths give a cell of 2 cm more than two lattice vertices of its own, and the region that
  /// the running product refines shrinks with what its lattices take.
  float least, most;
};
std::span<const CrfKnob> crf_knobs();

struct SweepRow {
  std::string knob;
  float value = 0;
  CrfScore score;
};

/// One row per knob and factor (of 1, where a weight is 0), everything else as in `base`; `report` is called
/// with each row as it comes.
rt::Result<std::vector<SweepRow>> sweep(std::span<const LabelledPoints> rooms,
                                        const label::CrfParameters& base, std::span<const float> factors,
                                        const std::function<void(const SweepRow&)>& report);

/// What the fit raises: the mean of the four metrics, and a hundredth of the true materials' probability,
/// which still has a slope where no point changes its winner. Mean IU alone has the fit trade pixels for rare
/// materials.
double fit_objective(const CrfScore& score);

/// Coordinate descent: each knob in turn is multiplied by the step as long as that raises the objective, or
/// divided, within the knob's limits; a weight may also drop to 0, or start again from 0.1. A round without
/// gain goes on to the next step: 2, 1.41, 1.19. `report` is called with every improvement.
rt::Result<label::CrfParameters> fit(std::span<const LabelledPoints> rooms, const label::CrfParameters& base,
                                     int rounds_max, const std::function<void(const SweepRow&)>& report);

}  // namespace tactus::bench
