// `tactus record`, and what a run makes of its file.
#include <gtest/gtest.h>

#include <chrono>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>

#include "firmware_host/record.hpp"
#include "firmware_host/run.hpp"
#include "firmware_host/tac_recording.hpp"
#include "hal/faults/faults.hpp"
#include "tests/firmware_host/frames_of.hpp"
#include "tests/firmware_host/program.hpp"
#include "tests/support/command_line.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tactus::firmware {
namespace {

using nlohmann::json;
using test::frames_of;
using test::Outcome;

class Record : public ::testing::Test {
 protected:
  std::string path(const std::string& name) { return (folder_.path() / name).string(); }
  Outcome call(const std::vector<std::string>& words) {
    PipelineCommands commands;
    commands.record = record;
    commands.run = run;
    return test::call_tactus(words, commands);
  }
  json recorded(const std::string& source, const std::string& to, const std::vector<std::string>& more = {}) {
    std::vector<std::string> words = {"record", source, "--out", path(to), "--json"};
    words.insert(words.end(), more.begin(), more.end());
    const Outcome o = call(words);
    EXPECT_EQ(o.code, 0) << o.err;
    return o.code == 0 ? json::parse(o.out) : json();
  }
  json summary_of(const std::string& source, const std::vector<std::string>& more) {
    std::vector<std::string> words = {"run", source, "--runner", "lockstep", "--json"};
    words.insert(words.end(), more.begin(), more.end());
    const Outcome o = call(words);
    EXPECT_EQ(o.code, 0) << o.err;
    return o.code == 0 ? json::parse(o.out) : json();
  }

  test::TemporaryFolder folder_;
};

constexpr const char* kRoom = "synthetic:bedroom?frames=12&mode=320x240&registered=0";

TEST_F(Record, FileHoldsEveryFrameOfTheSource) {
  const json j = recorded(kRoom, "room.tac");
  EXPECT_EQ(j["depth"]["frames"], 12);
  EXPECT_EQ(j["color"]["frames"], 12);
  EXPECT_EQ(j["depth"]["dropped_by_recorder"], 0) << "a source that waits loses nothing";
  EXPECT_EQ(j["labels"], 12);
  EXPECT_EQ(j["file_bytes"], std::filesystem::file_size(path("room.tac")));
  EXPECT_EQ(j["ended_by"], "end_of_stream");
  const auto before = frames_of(kRoom), after = frames_of(path("room.tac"));
  expect_same_frames(before.depth, after.depth);
  expect_same_frames(before.color, after.color);
}

TEST_F(Record, RunOfTheFileMakesTheSameMap) {
  recorded(kRoom, "room.tac");
  // A room labels itself unless told otherwise, and a recording does not.
  const std::vector<std::string> more = {"--set", "labels.source=truth"};
  const json before = summary_of(kRoom, more), after = summary_of(path("room.tac"), more);
  for (const char* hash : {"map_hash", "label_hash", "geometry_hash"}) {
    EXPECT_TRUE(before[hash].is_string()) << hash;
    EXPECT_EQ(before[hash], after[hash]) << hash;
  }
}

TEST_F(Record, PartAndSecondsEndIt) {
  const json part = recorded(kRoom, "part.tac", {"--frames", "3:7"});
  EXPECT_EQ(part["depth"]["frames"], 4);
  EXPECT_EQ(part["color"]["frames"], 4);
  EXPECT_EQ(frames_of(path("part.tac")).depth[0].header.sequence, 3u);
  // Frames at 0, 33, 67, 100 ms; the one at 100 ms ends it.
  EXPECT_EQ(recorded(kRoom, "short.tac", {"--seconds", "0.09"})["depth"]["frames"], 4);
}

TEST_F(Record, TextSaysWhatIsInTheFile) {
  const Outcome o = call({"record", kRoom, "--out", path("room.tac"), "--color", "jpeg", "--quality", "80"});
  EXPECT_EQ(o.code, 0) << o.err;
  EXPECT_NE(o.out.find("12 depth and 12 colour frames"), std::string::npos) << o.out;
  EXPECT_NE(o.out.find("MB/s"), std::string::npos) << o.out;
  EXPECT_EQ(o.err, "");
}

TEST_F(Record, FileThatExistsAndWordsThatAreWrongAreRefused) {
  folder_.write("room.tac", "x");
  EXPECT_EQ(call({"record", kRoom, "--out", path("room.tac")}).code, 2);
  EXPECT_EQ(call({"record", kRoom}).code, 2);
  EXPECT_EQ(call({"record", kRoom, "--out", path("a.tac"), "--seconds", "-1"}).code, 2);
  EXPECT_EQ(call({"record", kRoom, "--out", path("a.tac"), "--color", "png"}).code, 2);
  EXPECT_EQ(call({"record", "v4l2:/dev/absent", "--out", path("a.tac")}).code, 4);
  EXPECT_FALSE(std::filesystem::exists(path("a.tac")));
}

TEST_F(Record, DeviceThatStaysAwayEndsWithWhatCame) {
  auto sensor = open_source("synthetic:wall?frames=1000&mode=320x240");
  ASSERT_TRUE(sensor.has_value());
  sensor->is_live = true;  // so that it is waited for
  auto plan = hal::faults::parse_faults("[[fault]]\nkind = \"unplug\"\nfirst = 5\naway_frames = 100000\n", "plan");
  ASSERT_TRUE(plan.has_value()) << plan.error().message;
  const auto counts = hal::faults::inject(*plan, *sensor);
  TacRequest request;
  request.out = path("lost.tac");
  request.patience = rt::Duration{50'000'000};
  const auto result = record_tac(*sensor, kRoom, request);
  ASSERT_TRUE(result.has_value()) << result.error().message;
  EXPECT_TRUE(result->written.has_value());
  EXPECT_EQ(result->ended.depth, rt::Status::device_lost);
  EXPECT_GE(frames_of(path("lost.tac")).depth.size(), 5u);
}

TEST_F(Record, InterruptedRecordingIsWhole) {
  test::Program program({"record", "synthetic:bedroom?frames=3000&mode=320x240", "--out", path("room.tac")});
  std::error_code error;
  for (int i = 0; i < 3000; ++i) {
    if (std::filesystem::exists(path("room.tac"), error) && std::filesystem::file_size(path("room.tac"), error) > 3'000'000)
      break;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  program.send(SIGINT);
  const Outcome o = program.wait();
  EXPECT_EQ(o.code, 0) << o.err;
  EXPECT_NE(o.out.find("depth and"), std::string::npos) << o.out;
  const Outcome info = test::call_tactus({"info", path("room.tac"), "--json"});
  ASSERT_EQ(info.code, 0) << info.err;
  const json j = json::parse(info.out);
  EXPECT_EQ(j["recording"]["cut_off"], false);
  EXPECT_GT(j["frames"], 1);
}

}  // namespace
}  // namespace tactus::firmware
