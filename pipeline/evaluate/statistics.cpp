#include "pipeline/evaluate/statistics.hpp"

#include <algorithm>
#include <cmath>

namespace tactus::evaluate {

double percentile_of_sorted(std::span<const double> ascending, double fraction) {
  if (ascending.empty()) return 0;
  const double rank = std::ceil(fraction * static_cast<double>(ascending.size()));
  const auto index = static_cast<std::size_t>(std::max(rank - 1, 0.0));
  return ascending[std::min(index, ascending.size() - 1)];
}

ErrorStatistics statistics(std::span<double> errors) {
  ErrorStatistics s;
  s.count = errors.size();
  if (errors.empty()) return s;
  std::sort(errors.begin(), errors.end());
  const auto n = static_cast<double>(errors.size());
  double sum = 0, sum_of_squares = 0;
  for (const double e : errors) {
    sum += e;
    sum_of_squares += e * e;
  }
  s.mean = sum / n;
  s.rmse = std::sqrt(sum_of_squares / n);
  const std::size_t middle = errors.size() / 2;
  s.median = errors.size() % 2 == 1 ? errors[middle] : (errors[middle - 1] + errors[middle]) / 2;
  s.p95 = percentile_of_sorted(errors, 0.95);
  s.max = errors.back();
  return s;
}

}  // namespace tactus::evaluate
