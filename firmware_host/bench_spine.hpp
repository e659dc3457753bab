// The spine on frames that lie in memory, timed stage by stage.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "hal/calibration.hpp"
#include "hal/transform.hpp"
#include "pipeline/spine.hpp"
#include "rt/status.hpp"

namespace tactus::firmware {

/// The noisy bedroom, rendered ahead, so that rendering it is in no measurement. 1.5 MB a frame.
struct BenchFrames {
  hal::RigCalibration rig;
  T_WorldDepth T_world_first;
  std::vector<std::vector<std::uint16_t>> raw_depth;
  std::vector<std::vector<std::uint8_t>> rgb;
  [[nodiscard]] std::size_t count() const { return raw_depth.size(); }
};

/// The first `frames_count` frames of synthetic:bedroom at 640x480 with noise. Boot.
BenchFrames render_bench_frames(int frames_count);

inline constexpr std::size_t kBenchStagesCount = 5;
inline constexpr std::array<const char*, kBenchStagesCount> kBenchStages = {"register", "track", "integrate",
                                                                            "predict", "total"};
inline constexpr std::size_t kBenchIntegrate = 2, kBenchPredict = 3, kBenchTotal = 4;

struct BenchPass {
  // By stage, then by frame; frames of the warm-up left out.
  std::array<std::vector<double>, kBenchStagesCount> wall_ms, cpu_ms;
  std::uint64_t frames_lost = 0;
  std::uint32_t active_blocks_max = 0;
  std::uint32_t blocks_used = 0;  // at the end, those filled ahead included
  bool heap_is_guarded = false;   // whether heap calls are seen in this build
  std::uint64_t heap_calls = 0;   // inside the stages, from the first frame on
};

/// Drives a fresh spine through all frames on this thread. `far_blocks_count` blocks with a surface in them
/// are put into the map beforehand, 80 m from the room. `warm_up_count` frames are run and not timed.
/// budget_exceeded when the map has no room for the far blocks.
rt::Result<BenchPass> run_bench_pass(const BenchFrames& frames, const SpineConfig& config,
                                     std::size_t warm_up_count, std::uint32_t far_blocks_count);

/// Median and nearest-rank 99th percentile.
struct BenchFigures {
  double median = 0, p99 = 0, max = 0;
};
BenchFigures figures_of(std::span<const double> values);

}  // namespace tactus::firmware
