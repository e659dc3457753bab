// A machine whose only driver opens nothing: OpenAL's wave file writer, which is given no file.
#include <gtest/gtest.h>

#include <cstdlib>

#include "hal/openal/loopback_mixer.hpp"
#include "hal/openal/playback.hpp"

namespace tactus::hal::openal {
namespace {

class NoPlaybackTest : public testing::Test {
 protected:
  static void SetUpTestSuite() { setenv("ALSOFT_DRIVERS", "wave", 1); }
};

TEST_F(NoPlaybackTest, NoSoundCard_OneSentenceAndNothingElse) {
  testing::internal::CaptureStderr();
  const auto refused = Playback::create();
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, rt::ExitCode::device_unavailable);
  EXPECT_NE(refused.error().message.find("connect a sound card"), std::string::npos);
}

TEST_F(NoPlaybackTest, MixingIntoMemoryNeedsNoSoundCard) {
  const auto mixer = LoopbackMixer::create();
  EXPECT_TRUE(mixer || mixer.error().message.find("sound card") == std::string::npos);
}

}  // namespace
}  // namespace tactus::hal::openal
