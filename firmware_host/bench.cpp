#include "firmware_host/bench.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "firmware_host/bench_report.hpp"
#include "firmware_host/plan_whole.hpp"
#include "firmware_host/summary.hpp"
#include "pipeline/profile.hpp"

namespace tactus::firmware {
namespace {

constexpr std::size_t kWarmUpCount = 10;  // the first frames allocate all that is in view
constexpr std::uint32_t kMapTimesView = 10;

/// Of each frame the lesser CPU time of two passes, and the median of that.
double median_of_least(const BenchPass& a, const BenchPass& b) {
  std::vector<double> least;
  for (std::size_t i = 0; i < a.cpu_ms[kBenchTotal].size(); ++i)
    least.push_back(std::min(a.cpu_ms[kBenchTotal][i], b.cpu_ms[kBenchTotal][i]));
  return figures_of(least).median;
}

}  // namespace

rt::Result<std::string> bench(const BenchOptions& options) {
  BenchResult result;
  result.machine = describe_machine();
  result.date = date_and_time_utc();
  result.revision = revision();
  result.command = options.command;
  result.baseline = measure_machine();
  const BenchFrames frames = render_bench_frames(options.frames_count);
  result.warm_up_count = std::min(kWarmUpCount, frames.count() / 2);

  Profile profile = x86_profile();
  result.planned_bytes = plan_whole_program(profile, frames.rig).without_network_bytes();
  const std::uint32_t blocks = profile.spine.map.blocks_capacity;
  const double lists =
      static_cast<double>(map::ActiveSet::bytes_needed(blocks)) / (blocks * map::kBlockVoxels);
  result.bytes_per_voxel = map::Map::bytes_per_voxel(profile.spine.map) + lists;
  if (options.blocks_capacity > 0) profile.spine.map.blocks_capacity = options.blocks_capacity;
  result.config = profile.spine;

  // The small and the large map in turns, so that a machine that slows down meanwhile slows both.
  auto near = run_bench_pass(frames, profile.spine, result.warm_up_count, 0);
  if (!near) return near.error();
  SpineConfig large = profile.spine;
  large.map.blocks_capacity = map::kBlocksCapacityMax;
  const std::uint32_t room = large.map.blocks_capacity - near->blocks_used - large.evict_free_min;
  const std::uint32_t far_blocks = std::min(room, kMapTimesView * near->active_blocks_max);
  auto far = run_bench_pass(frames, large, result.warm_up_count, far_blocks);
  if (!far) return far.error();
  auto near_again = run_bench_pass(frames, profile.spine, result.warm_up_count, 0);
  if (!near_again) return near_again.error();
  auto far_again = run_bench_pass(frames, large, result.warm_up_count, far_blocks);
  if (!far_again) return far_again.error();
  result.near_total_ms = median_of_least(*near, *near_again);
  result.far_total_ms = median_of_least(*far, *far_again);
  result.near_blocks_used = near->blocks_used;
  result.far_blocks_used = far->blocks_used;
  result.pass = std::move(*near);
  std::array<double, 1> load{};
  if (getloadavg(load.data(), 1) == 1) result.load = load[0];
  return options.is_json ? to_text(bench_json(result)) : bench_text(result);
}

}  // namespace tactus::firmware
