#include "firmware_host/bench_spine.hpp"

#include <algorithm>
#include <memory>

#include "firmware_host/bench_time.hpp"
#include "hal/synthetic/synthetic.hpp"
#include "pipeline/evaluate/statistics.hpp"
#include "rt/arena.hpp"
#include "rt/heap_guard.hpp"
#include "rt/worker_pool.hpp"

namespace tactus::firmware {
namespace {

/// Blocks as a room has them: slabs of neighbours, each with a plane through its middle.
rt::Result<void> fill_far_away(map::Map& map, std::uint32_t blocks_count) {
  constexpr std::int32_t kSide = 100, kFirstX = -1000, kFirstY = -50, kFirstZ = -1000;
  auto staging = std::make_unique<map::BlockStaging>();
  for (int z = 0; z < map::kBlockSide; ++z)
    for (int y = 0; y < map::kBlockSide; ++y)
      for (int x = 0; x < map::kBlockSide; ++x) {
        const auto voxel = static_cast<std::size_t>(map::voxel_index(x, y, z));
        staging->tsdf[voxel] = static_cast<std::int16_t>((2 * z - 7) * 4000);
        staging->weight[voxel] = 20;
      }
  std::fill_n(staging->color, map::kBlockCells, map::ColorCell{90, 120, 150, 20});
  for (std::uint32_t i = 0; i < blocks_count; ++i) {
    const auto at = static_cast<std::int32_t>(i);
    const map::BlockIndex block = map.find_or_allocate(map::key_of(
        {kFirstX + at % kSide, kFirstY + at / kSide % kSide, kFirstZ + 2 * (at / (kSide * kSide))}));
    if (block == map::kNoBlock)
      return rt::Error{
          rt::ExitCode::budget_exceeded,
          "the map has no room for " + std::to_string(blocks_count) + " far blocks; raise --blocks."};
    map.publish(block, *staging);
  }
  return {};
}

}  // namespace

BenchFrames render_bench_frames(int frames_count) {
  hal::SyntheticOptions options;
  options.frames_count = frames_count;
  hal::synthetic::FrameRenderer renderer(
      std::make_shared<const hal::synthetic::Scene>(hal::synthetic::make_scene(options.scene)), options);
  BenchFrames frames;
  frames.rig = renderer.calibration();
  frames.T_world_first = renderer.pose(0);
  const auto pixels =
      static_cast<std::size_t>(frames.rig.depth.width) * static_cast<std::size_t>(frames.rig.depth.height);
  for (int i = 0; i < frames_count; ++i) {
    renderer.depth(i, frames.raw_depth.emplace_back(pixels));
    renderer.color(i, frames.rgb.emplace_back(3 * pixels));
  }
  return frames;
}

rt::Result<BenchPass> run_bench_pass(const BenchFrames& frames, const SpineConfig& config,
                                     std::size_t warm_up_count, std::uint32_t far_blocks_count) {
  const std::size_t map_bytes = rt::round_up(map::Map::bytes_needed(config.map), rt::kCacheLineBytes);
  const std::size_t spine_bytes = rt::round_up(Spine::bytes_needed(frames.rig, config), rt::kCacheLineBytes);
  auto arena = rt::Arena::reserve(map_bytes + spine_bytes);
  if (!arena) return arena.error();
  rt::WorkerPool pool;
  auto spine = std::make_unique<Spine>();
  const rt::Slice map_memory = arena->carve(map_bytes);
  spine->bind(map_memory, arena->carve(spine_bytes), frames.rig, config, frames.T_world_first, pool);
  arena->seal();

  BenchPass pass;
  for (std::size_t stage = 0; stage < kBenchStagesCount; ++stage) {
    pass.wall_ms[stage].reserve(frames.count());
    pass.cpu_ms[stage].reserve(frames.count());
  }
  pass.heap_is_guarded = rt::heap_guard::is_active();
  rt::heap_guard::seal();
  const std::uint64_t heap_calls_before = rt::heap_guard::was_total_calls();
  for (std::size_t i = 0; i < frames.count(); ++i) {
    std::array<BenchInstant, kBenchStagesCount> at;
    rt::Status tracked{};
    {
      const rt::RtScope scope;
      at[0] = BenchInstant::now();
      (void)spine->register_frame(frames.raw_depth[i], frames.rgb[i]);
      at[1] = BenchInstant::now();
      tracked = spine->track();
      at[2] = BenchInstant::now();
      (void)spine->integrate();
      at[3] = BenchInstant::now();
      (void)spine->predict();
      at[4] = BenchInstant::now();
    }
    // Not earlier: the frame that meets an empty map is the one that defines the world.
    if (i == 0)
      if (auto filled = fill_far_away(spine->map(), far_blocks_count); !filled) return filled.error();
    if (tracked != rt::Status::ok) ++pass.frames_lost;
    pass.active_blocks_max = std::max(pass.active_blocks_max, spine->result().active_blocks_count);
    if (i < warm_up_count) continue;
    for (std::size_t stage = 0; stage < kBenchStagesCount; ++stage) {
      const BenchInstant& begin = stage == kBenchTotal ? at.front() : at[stage];
      const BenchInstant& end = stage == kBenchTotal ? at.back() : at[stage + 1];
      pass.wall_ms[stage].push_back(static_cast<double>(end.wall_ns - begin.wall_ns) * 1e-6);
      pass.cpu_ms[stage].push_back(static_cast<double>(end.cpu_ns - begin.cpu_ns) * 1e-6);
    }
  }
  pass.heap_calls = rt::heap_guard::was_total_calls() - heap_calls_before;
  rt::heap_guard::unseal();
  pass.blocks_used = spine->map().blocks_used();
  return pass;
}

BenchFigures figures_of(std::span<const double> values) {
  std::vector<double> sorted(values.begin(), values.end());
  const evaluate::ErrorStatistics statistics = evaluate::statistics(sorted);
  return {statistics.median, evaluate::percentile_of_sorted(sorted, 0.99), statistics.max};
}

}  // namespace tactus::firmware
