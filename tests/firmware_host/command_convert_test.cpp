// `tactus convert` there and back: depth keeps every value.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "hal/openni2/openni2.hpp"
#include "tests/firmware_host/frames_of.hpp"
#include "tests/support/command_line.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tactus::firmware {
namespace {

using test::frames_of;
using test::Outcome;

class Convert : public ::testing::Test {
 protected:
  std::string path(const std::string& name) { return (folder_.path() / name).string(); }
  /// Answers the path written.
  std::string convert(const std::string& from, const std::string& to, const std::vector<std::string>& more = {}) {
    std::vector<std::string> words = {"convert", from, path(to)};
    words.insert(words.end(), more.begin(), more.end());
    const Outcome o = test::call_tactus(words);
    EXPECT_EQ(o.code, 0) << o.err;
    said_ = o.out;
    return path(to);
  }
  static bool has_openni2() {
    const hal::DeviceList list = hal::openni2::list_devices();
    return list.why_none.find("built without") == std::string::npos;
  }
  void expect_refusal(const std::vector<std::string>& words, const std::string& part) {
    const Outcome o = test::call_tactus(words);
    EXPECT_EQ(o.code, 2) << o.out;
    EXPECT_NE(o.err.find(part), std::string::npos) << o.err;
  }

  test::TemporaryFolder folder_;
  std::string said_;
};

constexpr const char* kRoom = "synthetic:bedroom?frames=5&mode=320x240&registered=0";

TEST_F(Convert, TumThroughTacKeepsEverythingButTheColourEncoding) {
  const std::string tum = convert(kRoom, "tum", {"--color", "png"});
  const std::string tac = convert(tum, "room.tac");
  const std::string again = convert(tac, "again", {"--color", "png"});
  const auto before = frames_of(tum), between = frames_of(tac), after = frames_of(again);
  for (const auto* seen : {&between, &after}) {
    expect_same_frames(before.depth, seen->depth);
    expect_same_frames(before.color, seen->color);
    EXPECT_EQ(before.sensor.calibration.depth, seen->sensor.calibration.depth);
    EXPECT_EQ(before.sensor.calibration.color, seen->sensor.calibration.color);
    EXPECT_EQ(before.sensor.calibration.T_color_depth.rotation.m, seen->sensor.calibration.T_color_depth.rotation.m);
    EXPECT_EQ(before.sensor.calibration.depth_m_per_unit, seen->sensor.calibration.depth_m_per_unit);
    ASSERT_EQ(before.sensor.truth.size(), seen->sensor.truth.size());
    for (std::size_t i = 0; i < before.sensor.truth.size(); ++i)
      EXPECT_EQ(before.sensor.truth[i].time, seen->sensor.truth[i].time);
    ASSERT_TRUE(seen->sensor.labels && before.sensor.labels);
    std::vector<std::uint8_t> a(320 * 240), b(320 * 240);
    ASSERT_EQ(before.sensor.labels->read(3, a), rt::Status::ok);
    ASSERT_EQ(seen->sensor.labels->read(3, b), rt::Status::ok);
    EXPECT_EQ(a, b);
    ASSERT_TRUE(seen->sensor.gravity_depth.has_value());
    EXPECT_EQ(seen->sensor.gravity_depth->y, before.sensor.gravity_depth->y);
  }
}

TEST_F(Convert, SevenScenesThroughTacKeepsDepth) {
  const std::string scenes = convert(kRoom, "scenes", {"--layout", "7scenes", "--color", "png"});
  EXPECT_NE(said_.find("rounded to whole millimetres"), std::string::npos) << said_;
  const std::string tac = convert(scenes, "room.tac");
  EXPECT_EQ(said_.find("rounded"), std::string::npos) << said_;
  const std::string again = convert(tac, "again", {"--layout", "7scenes", "--color", "png"});
  const auto before = frames_of(scenes), after = frames_of(again);
  expect_same_frames(before.depth, after.depth);
  expect_same_frames(before.color, after.color);
  for (std::size_t i = 0; i < before.depth.size(); ++i)
    EXPECT_EQ(before.depth[i].header.sequence, after.depth[i].header.sequence);
  EXPECT_EQ(before.sensor.truth.size(), after.sensor.truth.size());
}

TEST_F(Convert, TacThroughOniKeepsDepthInMillimetres) {
  if (!has_openni2()) GTEST_SKIP() << "this build has no OpenNI2";
  const std::string scenes = convert("synthetic:bedroom?frames=5&mode=320x240", "scenes", {"--layout", "7scenes"});
  const std::string tac = convert(scenes, "room.tac");
  const std::string oni = convert(tac, "room.oni");
  EXPECT_EQ(said_.find("rounded"), std::string::npos) << said_;
  const std::string again = convert(oni, "again.tac");
  const auto before = frames_of(tac), between = frames_of(oni), after = frames_of(again);
  constexpr std::int64_t kMicrosecond = 1000;
  expect_same_frames(before.depth, between.depth, kMicrosecond);
  expect_same_frames(before.depth, after.depth, kMicrosecond);
  expect_same_frames(before.color, after.color, kMicrosecond);
  EXPECT_EQ(after.sensor.calibration.depth_m_per_unit, 0.001);
}

TEST_F(Convert, OniOfAnotherUnitSaysThatItRounds) {
  convert("synthetic:wall?frames=2&mode=320x240", "wall.oni");
  EXPECT_NE(said_.find("rounded to whole millimetres"), std::string::npos) << said_;
}

TEST_F(Convert, PartGoesIntoTheFileAlone) {
  const std::string tac = convert(kRoom, "part.tac", {"--frames", "1:4", "--no-labels"});
  const auto seen = frames_of(tac);
  ASSERT_EQ(seen.depth.size(), 3u);
  EXPECT_EQ(seen.depth[0].header.sequence, 1u);
  EXPECT_EQ(seen.color.size(), 3u);
  EXPECT_FALSE(seen.sensor.labels);
}

TEST_F(Convert, JpegInTacIsSmaller) {
  const auto bytes = [](const std::string& file) { return std::filesystem::file_size(file); };
  const auto lossless = bytes(convert(kRoom, "a.tac")), jpeg = bytes(convert(kRoom, "b.tac", {"--color", "jpeg"}));
  EXPECT_LT(jpeg, lossless);
  expect_same_frames(frames_of(path("a.tac")).depth, frames_of(path("b.tac")).depth);
}

TEST_F(Convert, LayoutSaysWhatTheEndingDoesNot) {
  const std::string odd = convert(kRoom, "odd.bin", {"--layout", "tac"});
  EXPECT_EQ(frames_of(odd).depth.size(), 5u);
}

TEST_F(Convert, EncodingThatTheLayoutHasNotIsBadUsage) {
  expect_refusal({"convert", kRoom, path("x.tac"), "--color", "png"}, "as-came or jpeg");
  expect_refusal({"convert", kRoom, path("x"), "--color", "as-came"}, "jpeg or png");
  expect_refusal({"convert", kRoom, path("x.oni"), "--color", "jpeg"}, "leave --color out");
}

TEST_F(Convert, FileThatExistsIsRefused) {
  folder_.write("x.tac", "x");
  folder_.write("x.oni", "x");
  expect_refusal({"convert", kRoom, path("x.tac")}, "x.tac");
  expect_refusal({"convert", kRoom, path("x.oni")}, "x.oni");
}

TEST_F(Convert, InfoTellsHowSmallTheFileIs) {
  const std::string tac = convert(kRoom, "room.tac");
  const Outcome o = test::call_tactus({"info", tac, "--json"});
  ASSERT_EQ(o.code, 0) << o.err;
  const auto j = nlohmann::json::parse(o.out);
  EXPECT_EQ(j["file_bytes"], std::filesystem::file_size(tac));
  EXPECT_EQ(j["recording"]["depth"]["raw_bytes"], 5 * 320 * 240 * 2);
  EXPECT_GT(j["recording"]["depth"]["compression"], 1.5);
  EXPECT_EQ(j["recording"]["cut_off"], false);
  EXPECT_EQ(j["recording"]["info"]["source"], kRoom);
  EXPECT_EQ(j["pairing"]["pairs"], 5);
  EXPECT_EQ(j["pairing"]["skew_ms_histogram"]["0"], 5);
  const Outcome quick = test::call_tactus({"info", tac, "--quick"});
  EXPECT_NE(quick.out.find("of what the device gave"), std::string::npos) << quick.out;
}

TEST_F(Convert, RealRecordingsKeepEveryDepthValue) {
  const auto tum = test::shared_data("tum_fr1_rpy"), kitchen = test::shared_data("kitchen_7scenes");
  if (!tum || !kitchen) GTEST_SKIP() << "the recordings beside the project are absent";
  const SourceOptions ten{{0, 10}};
  const std::string tum_tac = convert(tum->string(), "t.tac", {"--frames", "0:10"});
  expect_same_frames(frames_of(tum->string(), ten).depth, frames_of(convert(tum_tac, "t")).depth);
  const std::string kitchen_tac = convert(kitchen->string(), "k.tac", {"--frames", "0:10"});
  const auto before = frames_of(kitchen->string(), ten);
  expect_same_frames(before.depth, frames_of(convert(kitchen_tac, "k", {"--layout", "7scenes"})).depth);
  if (has_openni2()) expect_same_frames(before.depth, frames_of(convert(kitchen_tac, "k.oni")).depth, 1000);
}

}  // namespace
}  // namespace tactus::firmware
