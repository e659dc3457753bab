// The arithmetic of the bench and its report, on figures known beforehand.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>

#include "firmware_host/bench_report.hpp"

namespace tactus::firmware {
namespace {

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

BenchResult sample() {
  BenchResult r;
  r.command = "tactus bench";
  r.machine.cpu = "Testable 9000";
  r.machine.cores_count = 2;
  r.baseline = {"AVX2", 21, 50, 58, {{{32u << 10, 2}, {1u << 20, 7}, {8u << 20, 137}}}};
  for (std::size_t stage = 0; stage < kBenchStagesCount; ++stage)
    for (int frame = 0; frame < 5; ++frame) {
      r.pass.cpu_ms[stage].push_back(static_cast<double>(stage + 1));
      r.pass.wall_ms[stage].push_back(2.0 * static_cast<double>(stage + 1));
    }
  r.pass.active_blocks_max = 100;
  r.planned_bytes = 70'000'000;
  r.bytes_per_voxel = 4.9;
  r.near_blocks_used = 150;
  r.far_blocks_used = 1150;
  r.near_total_ms = 5;
  r.far_total_ms = 5.25;
  return r;
}

TEST(BenchFigures, AreMedianNearestRankPercentileAndMaximum) {
  std::vector<double> values(200);
  std::iota(values.rbegin(), values.rend(), 1.0);  // 200, 199, ... 1
  const BenchFigures f = figures_of(values);
  EXPECT_DOUBLE_EQ(f.median, 100.5);
  EXPECT_DOUBLE_EQ(f.p99, 198);
  EXPECT_DOUBLE_EQ(f.max, 200);
  EXPECT_DOUBLE_EQ(figures_of({}).max, 0);
}

TEST(BenchMachine, SlownessIsThatOfTheWorstMeasure) {
  MachineBaseline b = {"", kReferenceRmwGbPerS, 0, kReferenceFusedGflops, {}};
  b.loads[2].ns = kReferenceLoad8MibNs;
  EXPECT_DOUBLE_EQ(slowness(b), 1);
  b.fused_gflops /= 2;
  EXPECT_DOUBLE_EQ(slowness(b), 2);
  b.loads[2].ns *= 3;
  EXPECT_DOUBLE_EQ(slowness(b), 3);
  b = {"", 2 * kReferenceRmwGbPerS, 0, 4 * kReferenceFusedGflops, {}};
  b.loads[2].ns = kReferenceLoad8MibNs / 2;
  EXPECT_DOUBLE_EQ(slowness(b), 0.5);
}

TEST(BenchMachine, EveryMeasureIsANumberAboveZero) {
  const MachineBaseline sut = measure_machine();
  EXPECT_STRNE(sut.vector_target, "");
  for (const double value : {sut.rmw_gb_per_s, sut.mul_add_gflops, sut.fused_gflops, sut.loads[0].ns,
                             sut.loads[1].ns, sut.loads[2].ns, slowness(sut)})
    EXPECT_TRUE(std::isfinite(value) && value > 0) << value;
  EXPECT_EQ(sut.loads[0].bytes, 32u << 10);
  EXPECT_EQ(sut.loads[2].bytes, 8u << 20);
}

TEST(BenchText, PutsEachFigureBesideItsLimitAndTheLimitOfThisMachine) {
  const std::string text = bench_text(sample());
  for (const char* part : {"Testable 9000", "takes 2.00 times", "register", "predict", "total", "70.0 MB",
                           "+5.0 %", "CPU time is", "11.5 times the view", "this build cannot see them"})
    EXPECT_TRUE(contains(text, part)) << part << "\n" << text;
  // integrate: 3 ms of 4 must and 2.5 goal, twice that here; predict: 4 of 4; total: 5 of 5.
  EXPECT_TRUE(contains(text, "4.0    2.5      8.0    5.0   within must")) << text;
  EXPECT_TRUE(contains(text, "12.0    5.0     24.0   10.0   reaches the goal")) << text;
  BenchResult slow = sample();
  slow.pass.cpu_ms[kBenchTotal].assign(5, 12.5);
  slow.pass.heap_is_guarded = true;
  slow.pass.heap_calls = 3;
  const std::string slow_text = bench_text(slow);
  EXPECT_TRUE(contains(slow_text, "24.0   10.0   OVER MUST")) << slow_text;
  EXPECT_TRUE(contains(slow_text, "0      0   OVER MUST")) << slow_text;
}

TEST(BenchJson, HoldsFiguresLimitsAndWhereTheyComeFrom) {
  const auto json = bench_json(sample());
  EXPECT_EQ(json["stages"]["integrate"]["cpu_ms"]["median"], 3);
  EXPECT_EQ(json["stages"]["integrate"]["wall_ms"]["median"], 6);
  EXPECT_EQ(json["stages"]["integrate"]["must_ms"], 4);
  EXPECT_FALSE(json["stages"]["track"].contains("must_ms"));
  EXPECT_EQ(json["planned_mb"]["value"], 70);
  EXPECT_NEAR(json["map_10x"]["growth_percent"]["value"].get<double>(), 5, 1e-9);
  EXPECT_TRUE(json["heap_calls"].is_null()) << "unknown is not zero";
  for (const char* key : {"machine", "date", "revision", "command", "baseline"})
    EXPECT_TRUE(json.contains(key)) << key;
}

}  // namespace
}  // namespace tactus::firmware
