// Sessions with faults of the cameras: what the summary counts of each kind, and that tracking goes on or comes back.
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "tests/firmware_host/program.hpp"
#include "tests/support/shared_data.hpp"

namespace tactus::firmware {
namespace {

using nlohmann::json;
using test::is_noted;
using test::Outcome;
using test::run_tactus;

constexpr int kFrames = 60;
// At half resolution a session takes half a second.
constexpr const char* kSmallBedroom = "synthetic:bedroom?mode=320x240&frames=60";
constexpr const char* kBedroom = "synthetic:bedroom?mode=640x480&frames=60";

std::string plan(const std::string& kind) {
  return std::string(TACTUS_SOURCE_DIR) + "/tests/hal/faults/plans/" + kind + ".toml";
}

/// The summary of a session that ended with exit code 0; `kind` empty: without faults.
json summary_with(const std::string& source, const std::string& kind, const std::vector<std::string>& more = {},
                  const std::string& runner = "lockstep") {
  std::vector<std::string> words = {"run", source, "--runner", runner, "--model", "none", "--json"};
  if (!kind.empty()) words.insert(words.end(), {"--faults", plan(kind)});
  words.insert(words.end(), more.begin(), more.end());
  const Outcome outcome = run_tactus(words);
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  return json::parse(outcome.out, nullptr, false);
}

std::uint64_t number(const json& summary, const char* key) { return summary.at(key).get<std::uint64_t>(); }
std::uint64_t of_stream(const json& summary, const char* stream, const char* key) {
  return summary.at("sensor").at(stream).at(key).get<std::uint64_t>();
}
std::uint64_t injected(const json& summary, const std::string& kind, const char* stream) {
  const json& all = summary.at("faults").at("injected");
  return all.contains(kind) ? all.at(kind).at(stream).get<std::uint64_t>() : 0;
}

/// Seconds of the last tracked frame.
double last_tracked_s(const std::filesystem::path& folder) {
  std::ifstream file(folder / "trajectory.txt");
  std::string line, last;
  while (std::getline(file, line))
    if (!line.empty() && line[0] != '#') last = line;
  return last.empty() ? -1 : std::stod(last);
}

void expect_frames_add_up(const json& s) {
  EXPECT_EQ(number(s, "frames_in"), number(s, "frames_tracked") + number(s, "frames_dropped") + number(s, "frames_lost") +
                                        number(s, "frames_rejected"));
}

/// Of a source of so many frames: each came, was missed, or came twice.
void expect_counted(const json& s, const std::string& kind, std::uint64_t frames_count) {
  expect_frames_add_up(s);
  const std::uint64_t depth = injected(s, kind, "depth"), color = injected(s, kind, "color");
  ASSERT_GT(depth, 0u) << "nothing was tried";
  EXPECT_EQ(color > 0, kind != "color_without_depth");
  const bool is_rejected = kind == "duplicate" || kind == "out_of_order" || kind == "half_frame";
  EXPECT_EQ(number(s, "frames_rejected"), is_rejected ? depth : 0);
  EXPECT_EQ(of_stream(s, "color", "rejected"), is_rejected ? color : 0);
  const bool is_missing = kind == "drop" || kind == "unplug" || kind == "color_without_depth";
  const std::uint64_t frames_per_fault = kind == "unplug" ? 8 : 1;
  EXPECT_EQ(number(s, "frames_missing"), is_missing ? depth * frames_per_fault : 0);
  EXPECT_EQ(of_stream(s, "color", "missing"), is_missing ? color * frames_per_fault : 0);
  EXPECT_EQ(number(s, "frames_in") + number(s, "frames_missing"), frames_count + (kind == "duplicate" ? depth : 0));
  EXPECT_EQ(of_stream(s, "depth", "duplicates"), kind == "duplicate" ? depth : 0);
  EXPECT_EQ(of_stream(s, "color", "duplicates"), kind == "duplicate" ? color : 0);
  EXPECT_EQ(of_stream(s, "depth", "out_of_order"), kind == "out_of_order" ? depth : 0);
  EXPECT_EQ(of_stream(s, "color", "out_of_order"), kind == "out_of_order" ? color : 0);
  // The first frame after a leap could be a hiccup; the second settles it.
  const std::uint64_t repairs_per_fault = kind == "clock_jump" ? 2 : kind == "stuck_clock" ? 1 : 0;
  EXPECT_EQ(of_stream(s, "depth", "times_repaired"), repairs_per_fault * depth);
  EXPECT_EQ(of_stream(s, "color", "times_repaired"), repairs_per_fault * color);
  EXPECT_EQ(of_stream(s, "depth", "time_jumps"), kind == "clock_jump" ? depth : 0);
  EXPECT_EQ(s.at("sensor").at("losses"), kind == "unplug" ? depth + color : 0) << "of each stream";
  EXPECT_EQ(s.at("sensor").at("timeouts"), kind == "color_without_depth" ? depth : 0);
  EXPECT_EQ(is_noted(s, "was missing (--faults)"), kind == "half_frame");
  EXPECT_NE(s.at("description").get<std::string>().find("with faults injected"), std::string::npos);
  EXPECT_EQ(number(s, "frames_dropped"), 0u);
  EXPECT_EQ(number(s, "heap_allocations_after_seal"), 0u);
}

/// Whether a session sees the same pictures in the same order as without the fault.
bool changes_pictures(const std::string& kind) {
  return kind != "duplicate" && kind != "late" && kind != "stuck_clock" && kind != "clock_jump" &&
         kind != "slow_consumer";
}

const auto kKinds =
    testing::Values("drop", "duplicate", "late", "out_of_order", "corrupt_bytes", "half_frame", "stuck_clock",
                    "clock_jump", "color_without_depth", "unplug", "slow_consumer");
std::string kind_name(const testing::TestParamInfo<const char*>& info) { return info.param; }

class Faults : public testing::TestWithParam<const char*> {
 protected:
  const std::string kind_ = GetParam();
  test::TemporaryFolder folder_;
};

TEST_P(Faults, BedroomCountsThemAndIsTheSameTwice) {
  const json s = summary_with(kSmallBedroom, kind_);
  expect_counted(s, kind_, kFrames);
  const json again = summary_with(kSmallBedroom, kind_, {"--set", "threads=2"});
  EXPECT_EQ(again.at("map_hash"), s.at("map_hash")) << "on two threads";
  EXPECT_EQ(again.at("faults"), s.at("faults"));
  const json without = summary_with(kSmallBedroom, "");
  EXPECT_FALSE(without.contains("faults"));
  EXPECT_EQ(s.at("map_hash") != without.at("map_hash"), changes_pictures(kind_));
  constexpr std::uint64_t kMiB = 1 << 20;
  EXPECT_LT(s.at("memory").at("resident_bytes_peak").get<std::uint64_t>(),
            without.at("memory").at("resident_bytes_peak").get<std::uint64_t>() + 8 * kMiB);
}

TEST_P(Faults, BedroomIsTrackedRightToTheEnd) {
  const json s = summary_with(kBedroom, kind_, {"--out", folder_.path().string()});
  expect_counted(s, kind_, kFrames);
  EXPECT_NEAR(last_tracked_s(folder_.path()), (kFrames - 1) / 30.0, 1e-3);
  EXPECT_EQ(number(s, "frames_lost"), 0u);
  EXPECT_LT(s.at("accuracy").at("ate_rigid_mm").at("rmse").get<double>(), 1) << "0.2 without faults";
}

TEST_P(Faults, RealRecordingCountsThemAndIsFoundAgain) {
  const auto recording = test::shared_data("tum_fr1_rpy");
  if (!recording) GTEST_SKIP() << "tum_fr1_rpy is not beside the project";
  std::ifstream list(*recording / "depth.txt");
  std::uint64_t frames_count = 0;
  double last_s = 0;
  for (std::string line; std::getline(list, line);) {
    if (line.empty() || line[0] == '#') continue;
    ++frames_count;
    last_s = std::stod(line);
  }
  const json s = summary_with(recording->string(), kind_, {"--out", folder_.path().string()});
  expect_counted(s, kind_, frames_count);
  EXPECT_NEAR(last_tracked_s(folder_.path()), last_s, 0.02) << "a repaired clock goes on at the nominal rate";
  EXPECT_EQ(summary_with(recording->string(), kind_, {"--set", "threads=2"}).at("map_hash"), s.at("map_hash"));
}

INSTANTIATE_TEST_SUITE_P(Kinds, Faults, kKinds, kind_name);

TEST(AllFaults, LongSessionHoldsItsMemoryAndIsTrackedToTheEnd) {
  const auto session = [](int frames, const std::vector<std::string>& more) {
    return summary_with("synthetic:bedroom?mode=320x240&frames=" + std::to_string(frames), "all", more);
  };
  const json brief = session(300, {});
  const json s = session(900, {});
  expect_frames_add_up(s);
  for (const char* kind : {"drop", "duplicate", "late", "out_of_order", "corrupt_bytes", "half_frame", "stuck_clock",
                           "clock_jump", "color_without_depth", "unplug", "slow_consumer"})
    EXPECT_GT(injected(s, kind, "depth"), injected(brief, kind, "depth")) << kind;
  EXPECT_EQ(number(s, "heap_allocations_after_seal"), 0u);
  constexpr std::uint64_t kMiB = 1 << 20;
  EXPECT_LT(s.at("memory").at("resident_bytes_peak").get<std::uint64_t>(),
            brief.at("memory").at("resident_bytes_peak").get<std::uint64_t>() + 4 * kMiB)
      << "three times as long";
  EXPECT_EQ(s.at("map_hash"), session(900, {"--set", "threads=2"}).at("map_hash"));
  EXPECT_GT(10 * number(s, "frames_tracked"), 9 * (number(s, "frames_in") - number(s, "frames_rejected")));
}

TEST(AllFaults, RealtimeSessionAddsUp) {
  const json s = summary_with("synthetic:bedroom?mode=320x240&frames=200", "all", {}, "realtime");
  expect_frames_add_up(s);
  EXPECT_GT(number(s, "frames_tracked"), 0u);
  EXPECT_EQ(number(s, "heap_allocations_after_seal"), 0u);
  EXPECT_GT(injected(s, "slow_consumer", "depth"), 0u);
  EXPECT_GT(injected(s, "unplug", "depth"), 0u);
}

TEST(FaultsFile, OneThatIsWrongIsBadUsage) {
  const test::TemporaryFolder folder;
  const auto file = folder.write("wrong.toml", "[[fault]]\nkind = \"gremlin\"\nfirst = 1\n");
  const Outcome wrong = run_tactus({"run", kSmallBedroom, "--faults", file.string()});
  EXPECT_EQ(wrong.code, 2);
  EXPECT_NE(wrong.err.find("wrong.toml:2: kind must be one of drop, duplicate"), std::string::npos) << wrong.err;
  EXPECT_EQ(run_tactus({"run", kSmallBedroom, "--faults", (folder.path() / "none.toml").string()}).code, 2);
}

}  // namespace
}  // namespace tactus::firmware
