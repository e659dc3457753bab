#include <gtest/gtest.h>

#include <array>

#include "hal/null/display.hpp"
#include "hal/null/sound.hpp"

namespace tactus::hal::null {
namespace {

TEST(NullDisplay, BeginAsksForNoDrawingAndPresentCounts) {
  Display sut({320, 240});
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(sut.begin(), rt::Status::skipped);
    EXPECT_EQ(sut.present(), rt::Status::ok);
  }
  EXPECT_EQ(sut.frames_presented(), 3U);
  EXPECT_EQ(sut.format().width_px, 320);
}

TEST(NullSoundSink, WriteCountsSampleFramesNotSamples) {
  SoundSink sut({.sample_rate_hz = 48000, .channels_count = 2});
  const std::array<float, 960> samples{};
  EXPECT_EQ(sut.write(samples), rt::Status::ok);
  EXPECT_EQ(sut.write(samples), rt::Status::ok);
  EXPECT_EQ(sut.sample_frames_written(), 960U);
}

TEST(NullSoundSinkDeathTest, WriteOfHalfASampleFrameIsABug) {
  SoundSink sut({.sample_rate_hz = 48000, .channels_count = 2});
  const std::array<float, 3> samples{};
  EXPECT_DEATH((void)sut.write(samples), "assertion failed");
}

}  // namespace
}  // namespace tactus::hal::null
