// The shape in which errors are printed, the same for every evaluation.
#pragma once

#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>

#include "pipeline/evaluate/statistics.hpp"

namespace tactus::firmware {

inline constexpr const char* kStatisticsHeading =
    "                                        rmse       mean     median        p95        max    count\n";

/// One line under kStatisticsHeading; `scale` brings the unit of `s` to the one in `name`.
inline std::string statistics_line(const char* name, const evaluate::ErrorStatistics& s, double scale) {
  char line[160];
  std::snprintf(line, sizeof(line), "%-34s %9.3f  %9.3f  %9.3f  %9.3f  %9.3f  %7zu\n", name, s.rmse * scale,
                s.mean * scale, s.median * scale, s.p95 * scale, s.max * scale, s.count);
  return line;
}

inline nlohmann::json statistics_json(const evaluate::ErrorStatistics& s, double scale) {
  return {{"rmse", s.rmse * scale}, {"mean", s.mean * scale}, {"median", s.median * scale},
          {"p95", s.p95 * scale},   {"max", s.max * scale},   {"count", s.count}};
}

}  // namespace tactus::firmware
