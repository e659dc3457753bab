// What --set and a profile file say about keyframes.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "firmware_host/run_settings.hpp"
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

}  // namespace
}  // namespace tactus::firmware
