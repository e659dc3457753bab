#include "firmware_host/summary.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>

#include "firmware_host/machine.hpp"
#include "pipeline/evaluate/trajectory.hpp"
#include "tests/firmware_host/sample_run.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tactus::firmware {
namespace {

using nlohmann::json;

TEST(Summary, HoldsEveryKeyOfTheContract) {
  const json j = json::parse(to_text(summary_json(test::sample_run())));
  for (const char* key :
       {"frames_in", "frames_tracked", "frames_dropped", "frames_lost", "runner", "threads", "profile",
        "source", "stage_latency_ms", "frame_latency_ms", "memory", "map", "heap_allocations_after_seal",
        "map_hash", "relocalisations", "keyframes", "labels", "machine", "revision"})
    EXPECT_TRUE(j.contains(key)) << key;
  for (const char* stage : {"register", "track", "integrate", "predict"})
    for (const char* figure : {"p50", "p99", "max"})
      EXPECT_GT(j["stage_latency_ms"][stage][figure].get<double>(), 0) << stage << " " << figure;
  for (const char* figure : {"p50", "p99", "max"}) EXPECT_GT(j["frame_latency_ms"][figure].get<double>(), 0);
  for (const char* key : {"planned_bytes", "high_water_bytes", "resident_bytes_peak"})
    EXPECT_GT(j["memory"][key].get<std::uint64_t>(), 0u) << key;
  for (const char* key : {"blocks_used", "blocks_capacity", "bytes_per_voxel", "evicted"})
    EXPECT_TRUE(j["map"][key].is_number()) << key;
  EXPECT_EQ(j["labels"]["keyframes_segmented"], 24);
  EXPECT_DOUBLE_EQ(j["labels"]["age_ms_p50"], 14.2);
  EXPECT_EQ(j["frames_tracked"], 295);
  EXPECT_EQ(j["map_hash"], "8f3a11c20b77e5d4");
  EXPECT_EQ(j["label_hash"], "00c0ffee12345678");
}

TEST(Summary, MemoryTotalsAreOfTheArenaOnly) {
  RunResult r;
  r.memory = {
      {"a", "", "", 100, 40, false}, {"b", "", "", 10, std::nullopt, false}, {"c", "", "", 1000, 1000, true}};
  const json j = summary_json(r);
  EXPECT_EQ(j["memory"]["planned_bytes"], 110);
  EXPECT_EQ(j["memory"]["high_water_bytes"], 50);
  EXPECT_EQ(j["memory"]["rows"].size(), 3u);
  EXPECT_FALSE(j["memory"]["rows"][1].contains("high_water_bytes"));
}

TEST(Summary, InjectedFaultsAreThereWhenAskedFor) {
  RunResult r;
  EXPECT_FALSE(summary_json(r).contains("faults"));
  r.faults.emplace();
  EXPECT_TRUE(summary_json(r)["faults"]["injected"].empty());
  r.faults->push_back({"drop", 6, 5});
  EXPECT_EQ(summary_json(r)["faults"]["injected"]["drop"]["depth"], 6);
  EXPECT_EQ(summary_json(r)["faults"]["injected"]["drop"]["color"], 5);
}

TEST(Summary, UnknownFiguresAreLeftOutAndBadTextIsRepaired) {
  RunResult r;
  r.source = "caf\xe9";
  const json j = json::parse(to_text(summary_json(r)));
  EXPECT_FALSE(j.contains("accuracy"));
  EXPECT_FALSE(j.contains("surface_error_mean_mm"));
  EXPECT_EQ(j["source"], "caf\xEF\xBF\xBD");
}

TEST(Latency, NearestRankPercentilesSkipFramesThatDidNotRun) {
  std::vector<float> series;
  for (int i = 1; i <= 100; ++i) {
    series.push_back(static_cast<float>(101 - i));
    series.push_back(kDidNotRun);
  }
  const LatencySummary s = summarise_latency(series);
  EXPECT_EQ(s.count, 100u);
  EXPECT_DOUBLE_EQ(s.p50, 50);
  EXPECT_DOUBLE_EQ(s.p99, 99);
  EXPECT_DOUBLE_EQ(s.max, 100);
  EXPECT_DOUBLE_EQ(s.mean, 50.5);
  EXPECT_EQ(summarise_latency(std::vector<float>{kDidNotRun}).count, 0u);
}

TEST(TrajectoryFile, PositionsComeBackToTheBitAndRotationsToRounding) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::vector<evaluate::StampedPose> poses;
  for (int i = 0; i < 200; ++i) {
    const Quaternion q =
        Quaternion{normal(random), normal(random), normal(random), normal(random)}.normalized();
    poses.push_back(
        {{i * 33'333'333LL}, {Rotation::from(q), {normal(random), normal(random) * 1e-7, normal(random)}}});
  }
  const tactus::test::TemporaryFolder folder;
  ASSERT_TRUE(write_trajectory(folder.path() / "t.txt", poses).has_value());
  const auto read = evaluate::read_tum_trajectory(folder.path() / "t.txt");
  ASSERT_TRUE(read.has_value()) << read.error().message;
  ASSERT_EQ(read->poses.size(), poses.size());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    EXPECT_EQ(read->poses[i].time.ns, poses[i].time.ns);
    EXPECT_EQ(read->poses[i].T_world_depth.translation, poses[i].T_world_depth.translation);
    for (std::size_t k = 0; k < 9; ++k)
      EXPECT_NEAR(read->poses[i].T_world_depth.rotation.m[k], poses[i].T_world_depth.rotation.m[k], 4e-15);
  }
}

TEST(TrajectoryFile, TimeIsWrittenToTheNanosecond) {
  EXPECT_EQ(trajectory_line({{1305031229528784001}, {}}).substr(0, 21), "1305031229.528784001 ");
  EXPECT_EQ(trajectory_line({{7}, {}}), "0.000000007 0 0 0 0 0 0 1\n");
  EXPECT_EQ(trajectory_line({{-1'500'000'000}, {}}).substr(0, 13), "-1.500000000 ");
}

TEST(Events, OneJsonObjectPerLine) {
  const RunResult r = test::sample_run();
  const tactus::test::TemporaryFolder folder;
  ASSERT_TRUE(write_events(folder.path() / "events.jsonl", r.events).has_value());
  std::istringstream lines(folder.read("events.jsonl"));
  std::vector<json> events;
  for (std::string line; std::getline(lines, line);) events.push_back(json::parse(line));
  ASSERT_EQ(events.size(), r.events.size());
  EXPECT_EQ(events[1]["kind"], "contact");
  EXPECT_EQ(events[1]["material"], "fabric");
  EXPECT_DOUBLE_EQ(events[1]["speed_m_s"], 4.1);
  EXPECT_EQ(events[1]["position_world_m"].size(), 3u);
  EXPECT_FALSE(events[3].contains("material"));
}

TEST(Events, SurfaceThatNoLabelIsKnownOfIsSaidToBeUnknown) {
  RunEvent event;
  event.kind = "break";
  event.material = kUnknownMaterial;
  event.body_material = material_from_name("ceramic");
  event.outcome = "broke";
  const json j = json::parse(event_line(event));
  EXPECT_EQ(j["material"], "unknown");
  EXPECT_EQ(j["body_material"], "ceramic");
  EXPECT_EQ(j["outcome"], "broke");
}

TEST(Events, TextCannotBreakTheLine) {
  RunEvent event;
  event.kind = "note";
  event.text = "two\nlines \"quoted\" \xff";
  EXPECT_EQ(event_line(event).find('\n'), std::string::npos);
  EXPECT_TRUE(json::accept(event_line(event)));
}

TEST(Output, UnwritablePathIsASentence) {
  const tactus::test::TemporaryFolder folder;
  const auto result = write_summary(folder.path() / "absent" / "summary.json", {});
  ASSERT_FALSE(result.has_value());
  EXPECT_EQ(result.error().code, rt::ExitCode::failed);
  EXPECT_NE(result.error().message.find("summary.json"), std::string::npos);
}

TEST(Output, FullDiskIsASentence) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "/dev/full is absent";
  const auto result = write_summary("/dev/full", test::sample_run());
  ASSERT_FALSE(result.has_value());
  EXPECT_NE(result.error().message.find("disk full"), std::string::npos);
}

TEST(Machine, IsDescribed) {
  const Machine machine = describe_machine();
  EXPECT_FALSE(machine.cpu.empty());
  EXPECT_GE(machine.cores_count, 1);
  EXPECT_GT(machine.memory_bytes, 64ull << 20);
  EXPECT_EQ(machine.kernel.rfind("Linux ", 0), 0u);
  EXPECT_NE(machine.compiler, "");
  EXPECT_NE(machine.description().find("GiB"), std::string::npos);
  EXPECT_NE(std::string(revision()), "");
  EXPECT_EQ(date_and_time_utc().size(), std::string("2026-11-22 14:03 UTC").size());
}

TEST(Machine, ResidentPeakGrowsWithTouchedMemory) {
  const std::uint64_t before = resident_bytes_peak();
  std::vector<char> memory(std::size_t{64} << 20, 1);
  EXPECT_EQ(memory[12345], 1);
  EXPECT_GE(resident_bytes_peak(), before);
  EXPECT_GE(resident_bytes_peak(), memory.size());
}

}  // namespace
}  // namespace tactus::firmware
