// The five numbers by which a list of errors is judged.
#pragma once

#include <cstddef>
#include <span>

namespace tactus::evaluate {

/// Of non-negative errors, in the unit of the errors. All zero when count is 0.
struct ErrorStatistics {
  std::size_t count = 0;
  double rmse = 0, mean = 0, median = 0, p95 = 0, max = 0;
};

/// Percentiles are nearest-rank: the smallest value that is not below `fraction` of the values (so every
/// percentile is a value that occurred). The median of an even count is the mean of the middle two. Sorts
/// `errors`.
ErrorStatistics statistics(std::span<double> errors);

/// Nearest-rank percentile of ascending values; 0 when there are none. fraction in [0, 1].
double percentile_of_sorted(std::span<const double> ascending, double fraction);

}  // namespace tactus::evaluate
