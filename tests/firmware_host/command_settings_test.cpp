// What --set and a profile file say about keyframes.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "firmware_host/plan.hpp"
#include "firmware_host/plan_whole.hpp"
#include "firmware_host/run_settings.hpp"
#include "hal/synthetic/options.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tactus::firmware {
namespace {

using segment::KeyframePolicy;

rt::Result<RunSettings> settings_of(const std::vector<std::string>& set) { return read_settings("x86", set); }

TEST(KeyframeSettings, OneInTwelveUnlessTold) {
  const auto settings = settings_of({});
  ASSERT_TRUE(settings);
  EXPECT_EQ(settings->profile.keyframes.policy, KeyframePolicy::every);
  EXPECT_EQ(settings->profile.keyframes.every_frames, 12u);
}

TEST(KeyframeSettings, EveryNumberHasAKey) {
  const auto settings = settings_of(
      {"labels.keyframes=adaptive", "keyframe.every_frames=7", "keyframe.gap_min_frames=9",
       "keyframe.wait_max_frames=0", "keyframe.new_share=0.25", "keyframe.weak_share=0.5",
       "keyframe.old_share=0.75", "keyframe.weak_observations=5", "keyframe.old_frames=600",
       "keyframe.view_change_share=0.125", "keyframe.blur_max_px=2.5", "keyframe.exposure_share=1"});
  ASSERT_TRUE(settings) << settings.error().message;
  const segment::KeyframeRules& rules = settings->profile.keyframes;
  EXPECT_EQ(rules.policy, KeyframePolicy::adaptive);
  EXPECT_EQ(rules.every_frames, 7u);
  EXPECT_EQ(rules.gap_min_frames, 9u);
  EXPECT_EQ(rules.wait_max_frames, 0u);
  EXPECT_EQ(rules.new_share, 0.25f);
  EXPECT_EQ(rules.weak_share, 0.5f);
  EXPECT_EQ(rules.old_share, 0.75f);
  EXPECT_EQ(rules.weak_observations, 5u);
  EXPECT_EQ(rules.old_frames, 600u);
  EXPECT_EQ(rules.view_change_share, 0.125f);
  EXPECT_EQ(rules.blur_max_px, 2.5f);
  EXPECT_EQ(rules.exposure_share, 1.0f);
}

TEST(KeyframeSettings, ProfileFileTakesThemToo) {
  const test::TemporaryFolder folder;
  const std::string file =
      folder
          .write("one.toml",
                 "base = \"headset\"\n[labels]\nkeyframes = \"adaptive\"\n[keyframe]\nold_frames = 90\n")
          .string();
  const auto settings = read_settings(file, {});
  ASSERT_TRUE(settings) << settings.error().message;
  EXPECT_EQ(settings->profile.keyframes.policy, KeyframePolicy::adaptive);
  EXPECT_EQ(settings->profile.keyframes.old_frames, 90u);
}

TEST(KeyframeSettings, WrongOnesAreOneSentence) {
  const auto message_of = [](const std::string& set) {
    const auto settings = settings_of({set});
    EXPECT_FALSE(settings) << set;
    if (settings) return std::string();
    EXPECT_EQ(settings.error().code, rt::ExitCode::bad_usage);
    return settings.error().message;
  };
  EXPECT_EQ(message_of("labels.keyframes=often"),
            "--set: labels.keyframes is every or adaptive, not 'often'.");
  EXPECT_EQ(message_of("keyframe.new_share=0"),
            "--set: keyframe.new_share takes a number from 0.01 to 1, not '0'.");
  EXPECT_EQ(message_of("keyframe.gap_min_frames=0"),
            "--set: keyframe.gap_min_frames takes a number from 1 to 1000, not '0'.");
  EXPECT_NE(message_of("keyframe.often=1").find("keyframe.new_share"), std::string::npos)
      << "known keys are named";
}

TEST(Profiles, PaperAsksForThePapersMode) {
  const auto settings = read_settings("paper", {});
  ASSERT_TRUE(settings) << settings.error().message;
  EXPECT_EQ(settings->profile.sensor_mode.width, 960);
  EXPECT_EQ(settings->profile.sensor_mode.height, 540);
  EXPECT_EQ(settings->profile.sensor_mode.frame_rate_hz, 30);
  EXPECT_TRUE(settings->profile.needs_registered);
  for (const char* other : {"x86", "headset"}) {
    EXPECT_EQ(read_settings(other, {})->profile.sensor_mode.width, 0) << other;
    EXPECT_FALSE(read_settings(other, {})->profile.needs_registered) << other;
  }
}

TEST(Profiles, PaperFitsIntoItsLimitWithTheWholeRegion) {
  tactus::firmware::PlanOptions options;
  options.profile = "paper";
  const auto text = plan(options);
  ASSERT_TRUE(text) << text.error().message;
  EXPECT_NE(text->find("Profile paper at 960x540"), std::string::npos) << *text;
  hal::synthetic::SyntheticOptions wide;
  wide.mode = hal::synthetic::Mode::wide_960x540;
  Profile unlimited = paper_profile();
  unlimited.memory_bytes_max = std::size_t{1} << 30;
  for (const bool is_registered : {true, false}) {
    wide.is_registered = is_registered;
    const hal::RigCalibration rig = hal::synthetic::calibration_of(wide);
    EXPECT_EQ(plan_whole_program(paper_profile(), rig).without_network_bytes(),
              plan_whole_program(unlimited, rig).without_network_bytes());
  }
}

TEST(Profiles, FilesBeginWithAnyBuiltInAndSetTheMode) {
  const test::TemporaryFolder folder;
  const std::string file =
      folder.write("p.toml", "base = \"paper\"\n[sensor]\nmode = \"640x480@15\"\n").string();
  const auto settings = read_settings(file, {});
  ASSERT_TRUE(settings) << settings.error().message;
  EXPECT_TRUE(settings->profile.needs_registered);
  EXPECT_EQ(settings->profile.sensor_mode.width, 640);
  EXPECT_EQ(settings->profile.sensor_mode.frame_rate_hz, 15);
  EXPECT_FALSE(read_settings("x86", std::vector<std::string>{"sensor.mode=wide"}));
  const std::string wrong = folder.write("w.toml", "base = \"phone\"\n").string();
  EXPECT_NE(read_settings(wrong, {}).error().message.find("paper"), std::string::npos);
}

}  // namespace
}  // namespace tactus::firmware
