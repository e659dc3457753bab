// How long the spine's stages take, beside their budgets and beside the machine. Run alone (ctest -L
// latency); prints, and asserts only that the work was done: how long it takes is the machine's affair.
#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <cstdlib>

#include "firmware_host/bench_machine.hpp"
#include "firmware_host/bench_spine.hpp"
#include "firmware_host/machine.hpp"
#include "pipeline/budgets.hpp"
#include "pipeline/profile.hpp"

namespace tactus::firmware {
namespace {

TEST(LatencyBudget, SpineOnTheNoisySyntheticRoom) {
  constexpr std::size_t kFramesCount = 120, kWarmUpCount = 10;
  const Machine machine = describe_machine();
  const MachineBaseline baseline = measure_machine();
  const BenchFrames frames = render_bench_frames(kFramesCount);
  double load = 0;
  (void)getloadavg(&load, 1);
  std::printf("%s, revision %s\n%s, %s; %.1f threads want its cores\n", date_and_time_utc().c_str(),
              revision(), machine.description().c_str(), machine.compiler.c_str(), load);
  std::printf(
      "baseline (%s): %.1f GB/s read-modify-write, %.1f GFLOP/s multiply then add, %.1f fused; a load takes "
      "%.1f ns in 32 KiB, %.1f in 1 MiB, %.1f in 8 MiB\n",
      baseline.vector_target, baseline.rmw_gb_per_s, baseline.mul_add_gflops, baseline.fused_gflops,
      baseline.loads[0].ns, baseline.loads[1].ns, baseline.loads[2].ns);
  const auto pass = run_bench_pass(frames, x86_profile().spine, kWarmUpCount, 0);
  ASSERT_TRUE(pass) << pass.error().message;

  std::printf("%-10s %26s   %26s   %s\n", "ms", "CPU p50    p99    max", "wall p50    p99    max",
              "budget p99    max");
  constexpr std::array<Stage, 4> kStages = {Stage::register_frame, Stage::track, Stage::integrate,
                                            Stage::predict};
  for (std::size_t i = 0; i < kBenchStagesCount; ++i) {
    const BenchFigures cpu = figures_of(pass->cpu_ms[i]), wall = figures_of(pass->wall_ms[i]);
    std::printf("%-10s %12.2f %6.2f %6.2f   %12.2f %6.2f %6.2f", kBenchStages[i], cpu.median, cpu.p99,
                cpu.max, wall.median, wall.p99, wall.max);
    if (i < kStages.size()) {
      const StageBudget& budget = budget_of(kStages[i]);
      std::printf("   %10.2f %6.2f\n", budget.p99.milliseconds(), budget.max.milliseconds());
    } else {
      std::printf("   %10s %6.2f\n", "", kFrameBudget.milliseconds());
    }
    EXPECT_EQ(pass->cpu_ms[i].size(), kFramesCount - kWarmUpCount);
    EXPECT_GT(cpu.median, 0);
  }
  EXPECT_EQ(pass->frames_lost, 0U);
  EXPECT_GT(pass->active_blocks_max, 1000U) << "the room fills the image";
}

}  // namespace
}  // namespace tactus::firmware
