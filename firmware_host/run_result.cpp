#include "firmware_host/run_result.hpp"

#include <algorithm>
#include <cmath>

#include "pipeline/evaluate/statistics.hpp"

namespace tactus::firmware {

LatencySummary summarise_latency(std::span<const float> series_ms) {
  std::vector<double> values;
  values.reserve(series_ms.size());
  for (const float v : series_ms)
    if (!std::isnan(v)) values.push_back(static_cast<double>(v));
  LatencySummary s;
  s.count = values.size();
  if (values.empty()) return s;
  std::sort(values.begin(), values.end());
  double sum = 0;
  for (const double v : values) sum += v;
  s.mean = sum / static_cast<double>(values.size());
  s.p50 = evaluate::percentile_of_sorted(values, 0.50);
  s.p99 = evaluate::percentile_of_sorted(values, 0.99);
  s.max = values.back();
  return s;
}

std::uint64_t RunResult::planned_bytes() const {
  std::uint64_t sum = 0;
  for (const MemoryResult& row : memory)
    if (!row.is_outside_arena) sum += row.planned_bytes;
  return sum;
}

std::uint64_t RunResult::high_water_bytes() const {
  std::uint64_t sum = 0;
  for (const MemoryResult& row : memory)
    if (!row.is_outside_arena) sum += row.high_water_bytes.value_or(row.planned_bytes);
  return sum;
}

}  // namespace tactus::firmware
