// The plots of report.html as SVG text. Colours are classes (report_style.cpp), so that light and dark are
// one drawing.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "firmware_host/run_result.hpp"
#include "pipeline/evaluate/trajectory.hpp"

namespace tactus::firmware {

/// A value per frame over the whole run. More frames than columns are drawn as a band from the least to the
/// greatest value with the mean in it; NaN leaves a gap. A few spikes far above the 99th percentile are cut
/// at the upper edge and marked there, so that they do not flatten the rest.
struct SeriesPlot {
  std::span<const float> values = {};
  std::string unit = {};   // "ms"
  std::string label = {};  // what the values are, for readers of the text
  double budget = 0;       // drawn as a dashed line when above 0
  std::string budget_label = {};
  double seconds_per_value = 0;  // above 0: the axis shows seconds instead of frames
};
std::string series_svg(const SeriesPlot& plot);

/// The same without axes, as high as a line of text.
std::string sparkline_svg(std::span<const float> values, double budget);

/// Up to p99 as a bar, the median as a tick, the maximum as a whisker, on a scale from 0 to 1.5 budgets: the
/// line of the budget stands at the same place in every row. Empty without a budget.
std::string range_svg(const LatencySummary& latency_ms, double budget_ms);

enum class View : std::uint8_t {
  top,  // x to the right, -z up: as on a floor plan, seen from above
  side  // x or z, whichever the path covers more, to the right; y up
};

/// A camera path and, beside it when known, the true one, in metres to one scale. Both in the same world.
/// `gap_max`: a longer pause between poses (tracking was lost) is left open.
std::string trajectory_svg(std::span<const evaluate::StampedPose> estimate,
                           std::span<const evaluate::StampedPose> truth, View view, rt::Duration gap_max);

}  // namespace tactus::firmware
