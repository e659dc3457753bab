// `tactus info --check-registration` against rigs that are wrong by a known amount.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "firmware_host/open_source.hpp"
#include "firmware_host/registration_check.hpp"
#include "hal/replay/intrinsics_file.hpp"
#include "tests/support/command_line.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tactus::firmware {
namespace {

using nlohmann::json;
using test::Outcome;

json check(const std::string& source, const std::vector<std::string>& more = {}) {
  std::vector<std::string> words = {"info", source, "--check-registration", "--json"};
  words.insert(words.end(), more.begin(), more.end());
  const Outcome o = test::call_tactus(words);
  EXPECT_EQ(o.code, 0) << o.err;
  return o.code == 0 ? json::parse(o.out) : json();
}

/// The bedroom with a colour camera beside the depth camera, written as a folder whose calibration can then be spoilt.
class SpoiltRig : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<test::TemporaryFolder>();
    const Outcome o = test::call_tactus(
        {"convert", "synthetic:bedroom?frames=24&noise=0&registered=0", room(), "--color", "png", "--no-labels"});
    ASSERT_EQ(o.code, 0) << o.err;
    rig_ = open_source("synthetic:bedroom?frames=1&registered=0")->calibration;
  }
  static void TearDownTestSuite() { folder_.reset(); }
  static std::string room() { return (folder_->path() / "room").string(); }
  static void write(const hal::RigCalibration& rig) {
    folder_->write("room/calibration.toml", hal::replay::format_calibration_toml(rig));
  }
  void TearDown() override { write(rig_); }

  static std::unique_ptr<test::TemporaryFolder> folder_;
  static hal::RigCalibration rig_;
};
std::unique_ptr<test::TemporaryFolder> SpoiltRig::folder_;
hal::RigCalibration SpoiltRig::rig_;

TEST_F(SpoiltRig, RightCalibrationNeedsNoShift) {
  const json j = check(room());
  EXPECT_EQ(j["decidable"], true);
  EXPECT_EQ(j["pairs"], 24);
  EXPECT_NEAR(j["best_shift_px"][0].get<double>(), 0, 0.4);
  EXPECT_NEAR(j["best_shift_px"][1].get<double>(), 0, 0.4);
  EXPECT_LT(j["edge_distance_px"]["p50"].get<double>(), 1.25);
  EXPECT_GT(j["by_chance_px"]["p50"].get<double>(), 4.0);
  EXPECT_NE(j["verdict"].get<std::string>().find("good"), std::string::npos) << j["verdict"];
}

TEST_F(SpoiltRig, CentreOffIsReportedToHalfAPixel) {
  for (const auto& [dx, dy] : {std::pair{5.0, 0.0}, {-3.0, 7.5}, {0.0, -4.25}}) {
    hal::RigCalibration wrong = rig_;
    wrong.color.cx += dx;
    wrong.color.cy += dy;
    write(wrong);
    const json j = check(room());
    // The edges were put too far by (dx, dy), so that moving them back fits best.
    EXPECT_NEAR(j["best_shift_px"][0].get<double>(), -dx, 0.5);
    EXPECT_NEAR(j["best_shift_px"][1].get<double>(), -dy, 0.5);
    EXPECT_EQ(j["decidable"], true);
    EXPECT_NE(j["verdict"].get<std::string>().find("off"), std::string::npos) << j["verdict"];
  }
}

TEST_F(SpoiltRig, TranslationOffIsReportedAtTheEdgesDistance) {
  // Edges nearer and farther than the median move by more and less; farther off than this, that spread is half a pixel.
  for (const double off_m : {-0.015, 0.01}) {
    hal::RigCalibration wrong = rig_;
    wrong.T_color_depth.translation.x += off_m;
    write(wrong);
    const json j = check(room());
    const double expected_px = -rig_.color.fx * off_m / j["edge_depth_m"].get<double>();
    EXPECT_NEAR(j["best_shift_px"][0].get<double>(), expected_px, 0.5) << off_m;
    EXPECT_NEAR(j["best_shift_px"][1].get<double>(), 0, 0.5) << off_m;
  }
}

TEST_F(SpoiltRig, LensLeftOutIsSeenInTheDistances) {
  const double right_px = check(room())["edge_distance_px"]["p50"];
  hal::RigCalibration wrong = rig_;
  wrong.color.k1 = 0.5;
  write(wrong);
  EXPECT_GT(check(room())["edge_distance_px"]["p50"].get<double>(), right_px + 1);
}

TEST(CheckRegistration, RegisteredRoomNeedsNoShift) {
  const json j = check("synthetic:bedroom?frames=40", {"--pairs", "10"});
  EXPECT_EQ(j["pairs"], 10);
  EXPECT_EQ(j["decidable"], true);
  EXPECT_NEAR(j["best_shift_px"][0].get<double>(), 0, 0.5);
  EXPECT_NEAR(j["best_shift_px"][1].get<double>(), 0, 0.5);
}

TEST(CheckRegistration, BareWallCannotBeJudged) {
  const json j = check("synthetic:wall?frames=5&mode=320x240");
  EXPECT_EQ(j["decidable"], false);
  EXPECT_NE(j["verdict"].get<std::string>().find("Too little"), std::string::npos);
  const Outcome text = test::call_tactus({"info", "synthetic:wall?frames=5&mode=320x240", "--check-registration"});
  EXPECT_NE(text.out.find("by chance"), std::string::npos) << text.out;
}

TEST(CheckRegistration, WordsThatDoNotGoTogetherAreBadUsage) {
  EXPECT_EQ(test::call_tactus({"info", "synthetic:wall", "--check-registration", "--quick"}).code, 2);
  EXPECT_EQ(test::call_tactus({"info", "synthetic:wall", "--pairs", "5"}).code, 2);
  EXPECT_EQ(test::call_tactus({"info", "synthetic:wall", "--check-registration", "--pairs", "0"}).code, 2);
}

TEST(CheckRegistration, RealKitchenLiesWithinAPixel) {
  const auto folder = test::shared_data("kitchen_7scenes");
  if (!folder) GTEST_SKIP() << "the recordings beside the project are absent";
  const json j = check(folder->string());
  EXPECT_EQ(j["decidable"], true);
  EXPECT_LT(std::hypot(j["best_shift_px"][0].get<double>(), j["best_shift_px"][1].get<double>()), 1);
}

}  // namespace
}  // namespace tactus::firmware
