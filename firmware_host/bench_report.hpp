// The figures of a bench run as text and as JSON.
#pragma once

#include <array>
#include <limits>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "firmware_host/bench_machine.hpp"
#include "firmware_host/bench_spine.hpp"
#include "firmware_host/machine.hpp"

namespace tactus::firmware {

inline constexpr double kNoLimit = std::numeric_limits<double>::quiet_NaN();

/// What a figure must not exceed, and what it should reach.
struct BenchLimit {
  double must = kNoLimit, goal = kNoLimit;
};

/// Medians of the stages in kBenchStages' order, ms, on the reference machine (bench_machine.hpp).
inline constexpr std::array<BenchLimit, kBenchStagesCount> kBenchStageLimits_ms = {
    {{}, {}, {4, 2.5}, {4, 1.5}, {12, 5}}};
inline constexpr BenchLimit kBenchPlanned_mb = {96, 64};  // 10^6 bytes, without the network
inline constexpr BenchLimit kBenchBytesPerVoxel = {6, 5};
inline constexpr BenchLimit kBenchGrowth_percent = {10, 3};

struct BenchResult {
  Machine machine;
  std::string date, revision, command;
  double load = 0;  // of the machine in the last minute, runnable threads, this one included
  MachineBaseline baseline;
  std::size_t warm_up_count = 0;
  SpineConfig config;
  BenchPass pass;
  std::size_t planned_bytes = 0;  // x86 profile, whole program without the network
  double bytes_per_voxel = 0;
  // The same frames once more, in a map with far blocks: medians of each frame's least CPU time.
  std::uint32_t near_blocks_used = 0, far_blocks_used = 0;
  double near_total_ms = 0, far_total_ms = 0;
  [[nodiscard]] double growth_percent() const { return (far_total_ms / near_total_ms - 1) * 100; }
};

std::string bench_text(const BenchResult& result);
nlohmann::json bench_json(const BenchResult& result);

}  // namespace tactus::firmware
