// The program with a live sensor: OpenNI2 itself, with our driver beside it that plays a room as a device would.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "tests/firmware_host/frames_of.hpp"
#include "tests/firmware_host/program.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tactus::firmware {
namespace {

using nlohmann::json;
using test::Outcome;

constexpr const char* kRoom = "synthetic:bedroom?frames=40&mode=320x240";

class Live : public ::testing::Test {
 protected:
  std::string path(const std::string& name) { return (folder_.path() / name).string(); }
  /// `tactus WORDS...` on a machine with that device.
  static Outcome with_device(const std::string& plays, const std::vector<std::string>& words, const char* speed = "1") {
    test::ProgramSetup setup;
    setup.environment = {{"LD_LIBRARY_PATH", TACTUS_OPENNI2_ROOT},
                         {"TACTUS_OPENNI2_SOURCE", plays},
                         {"TACTUS_OPENNI2_SPEED", speed}};
    return test::run_tactus(words, setup);
  }
  test::TemporaryFolder folder_;
};

TEST_F(Live, DeviceIsListedWithItsFormats) {
  const Outcome o = with_device(kRoom, {"devices", "--json"});
  ASSERT_EQ(o.code, 0) << o.err;
  const json openni2 = json::parse(o.out)[0];
  ASSERT_EQ(openni2["devices"].size(), 1u) << o.out;
  EXPECT_EQ(openni2["devices"][0]["source"], "openni2:tactus://0");
  EXPECT_EQ(openni2["devices"][0]["formats"],
            json::array({"depth 1 mm 320x240 30 Hz", "colour RGB 320x240 30 Hz"}));
}

TEST_F(Live, RecordingHoldsWhatTheDevicePlayed) {
  const Outcome o =
      with_device(kRoom, {"record", "openni2:tactus://0", "--out", path("live.tac"), "--frames", "3:15", "--json"});
  ASSERT_EQ(o.code, 0) << o.err;
  const json j = json::parse(o.out);
  EXPECT_EQ(j["depth"]["frames"], 12);
  EXPECT_EQ(j["depth"]["dropped_by_recorder"], 0);
  const Outcome info = test::run_tactus({"info", path("live.tac"), "--json"});
  ASSERT_EQ(info.code, 0) << info.err;
  EXPECT_EQ(json::parse(info.out)["recording"]["was_live"], true);
  // The driver rounds to millimetres and sees no farther than 10 m.
  const auto room = test::frames_of(kRoom), live = test::frames_of(path("live.tac"));
  for (const auto& frame : live.depth) {
    EXPECT_NE(frame.header.arrived.ns, 0);
    const auto played = std::find_if(room.depth.begin(), room.depth.end(), [&](const auto& f) {
      return std::abs(f.header.time.ns - frame.header.time.ns) < 2000;
    });
    ASSERT_NE(played, room.depth.end()) << frame.header.time.ns;
    std::size_t differ_count = 0;
    for (std::size_t i = 0; i < frame.pixels.size(); ++i)
      differ_count += frame.pixels[i] != (played->pixels[i] + 2) / 5 ? 1u : 0u;
    EXPECT_EQ(differ_count, 0u);
  }
}

TEST_F(Live, RunThatIsRecorded_IsReplayedToTheSameBitsEveryTime) {
  const Outcome live = with_device(
      kRoom, {"run", "openni2", "--frames", "0:30", "--record", path("run.tac"), "--model", "none", "--json"});
  ASSERT_EQ(live.code, 0) << live.err;
  const json ran = json::parse(live.out);
  EXPECT_EQ(ran["sensor"]["live"], true);
  EXPECT_EQ(ran["frames_in"], 30);
  EXPECT_EQ(ran["frames_in"].get<int>(), ran["frames_tracked"].get<int>() + ran["frames_dropped"].get<int>() +
                                             ran["frames_lost"].get<int>() + ran["frames_rejected"].get<int>());
  EXPECT_EQ(ran["heap_allocations_after_seal"], 0);
  EXPECT_EQ(ran["recording"]["depth"]["frames"].get<int>() + ran["recording"]["depth"]["dropped"].get<int>(), 30);
  json replays[2];
  for (json& replay : replays) {
    const Outcome o =
        test::run_tactus({"run", path("run.tac"), "--runner", "lockstep", "--model", "none", "--json"});
    ASSERT_EQ(o.code, 0) << o.err;
    replay = json::parse(o.out);
    EXPECT_EQ(replay["frames_in"], ran["recording"]["depth"]["frames"]);
    EXPECT_EQ(replay["frames_dropped"], 0);
  }
  EXPECT_EQ(replays[0]["map_hash"], replays[1]["map_hash"]);
  const Outcome again = with_device(kRoom, {"run", "openni2", "--frames", "0:3", "--record", path("run.tac")});
  EXPECT_EQ(again.code, 2) << "a recording is never written over";
  EXPECT_NE(again.err.find("run.tac"), std::string::npos) << again.err;
}

TEST_F(Live, InfoReadsTheNextFrames) {
  const Outcome o = with_device(kRoom, {"info", "openni2", "--frames", "0:20", "--json"});
  ASSERT_EQ(o.code, 0) << o.err;
  const json j = json::parse(o.out);
  EXPECT_EQ(j["live"], true);
  EXPECT_EQ(j["depth"]["stream"]["frames"], 20);
  EXPECT_GE(j["pairing"]["pairs"], 15);
  const Outcome check = with_device(kRoom, {"info", "openni2", "--check-registration", "--pairs", "3", "--json"});
  ASSERT_EQ(check.code, 0) << check.err;
  EXPECT_EQ(json::parse(check.out)["pairs"], 3);
}

TEST_F(Live, ProfilePaperTakesThePapersMode) {
  // Slowly: this machine renders the room meanwhile.
  const Outcome o = with_device("synthetic:wall?frames=30&mode=960x540",
                                {"run", "openni2", "--profile", "paper", "--frames", "0:5", "--json"}, "0.2");
  ASSERT_EQ(o.code, 0) << o.err;
  const json j = json::parse(o.out);
  EXPECT_EQ(j["heap_allocations_after_seal"], 0);
  EXPECT_NE(o.out.find("depth 1 mm 960x540 30 Hz"), std::string::npos) << o.out;
}

TEST_F(Live, ProfilePaperRefusesAnotherMode) {
  const Outcome o = with_device(kRoom, {"run", "openni2", "--profile", "paper"});
  EXPECT_EQ(o.code, 2) << o.out;
  EXPECT_NE(o.err.find("320x240"), std::string::npos) << o.err;
}

TEST_F(Live, DepthThatIsNotRegisteredIsRefusedWhereItMustBe) {
  const std::string beside = std::string(kRoom) + "&registered=0";
  const Outcome asked = with_device(beside, {"info", "openni2?registered=1", "--quick"});
  EXPECT_EQ(asked.code, 4);
  EXPECT_NE(asked.err.find("does not register"), std::string::npos) << asked.err;
  EXPECT_EQ(with_device(beside, {"info", "openni2", "--quick"}).code, 0);
}

TEST_F(Live, CalibrationFileReplacesTheAssumedOne) {
  ASSERT_EQ(test::run_tactus({"convert", "synthetic:wall?frames=1&registered=0", path("rig")}).code, 0);
  const std::string beside = std::string(kRoom) + "&registered=0";
  const Outcome o =
      with_device(beside, {"info", "openni2?calibration=" + path("rig/calibration.toml"), "--quick", "--json"});
  ASSERT_EQ(o.code, 0) << o.err;
  const json j = json::parse(o.out);
  EXPECT_EQ(j["color"]["intrinsics"]["fx"], 538.0 / 2);
  EXPECT_EQ(j["color"]["intrinsics"]["k1"], 0.09);
  const Outcome wrong =
      with_device(kRoom, {"info", "openni2?calibration=" + path("rig/calibration.toml"), "--quick"});
  EXPECT_EQ(wrong.code, 2);
  EXPECT_NE(wrong.err.find("registered = false"), std::string::npos) << wrong.err;
}

}  // namespace
}  // namespace tactus::firmware
