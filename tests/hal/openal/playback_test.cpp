// On OpenAL's null device, which takes samples at the pace of a clock as a sound card would.
#include "hal/openal/playback.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <optional>
#include <thread>
#include <vector>

namespace tactus::hal::openal {
namespace {

class PlaybackTest : public testing::Test {
 protected:
  static void SetUpTestSuite() { setenv("ALSOFT_DRIVERS", "null", 1); }
  void SetUp() override {
    auto created = Playback::create();
    if (!created && created.error().code == rt::ExitCode::device_unavailable)
      GTEST_SKIP() << created.error().message;
    ASSERT_TRUE(created) << created.error().message;
    sut_.emplace(std::move(*created));
  }

  /// Writes until the device has taken it; the number of times it was full, or -1 when it never takes it.
  int write_when_there_is_room(const std::vector<float>& samples) {
    for (int tries = 0; tries < 500; ++tries) {
      const rt::Status status = sut_->write(samples);
      if (status == rt::Status::ok) return tries;
      EXPECT_EQ(status, rt::Status::full);
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    return -1;
  }

  std::optional<Playback> sut_;
};

const std::vector<float> kVideoFrame(2 * 1600, 0.1F);

TEST_F(PlaybackTest, TakesAllOrNothingUntilItHasPlayed) {
  int taken = 0;
  rt::Status status = rt::Status::ok;
  while ((status = sut_->write(kVideoFrame)) == rt::Status::ok && taken < 50) ++taken;
  EXPECT_EQ(status, rt::Status::full);
  EXPECT_EQ(sut_->sample_frames_written(), 1600U * static_cast<unsigned>(taken));
  EXPECT_GE(taken, 2);
  EXPECT_GE(write_when_there_is_room(kVideoFrame), 0);
}

TEST_F(PlaybackTest, StreamsAtTheDevicesPace) {
  const auto start = std::chrono::steady_clock::now();
  for (int frame = 0; frame < 12; ++frame) ASSERT_GE(write_when_there_is_room(kVideoFrame), 0) << frame;
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  // 400 ms of sound, of which 100 may wait in the queue and one of OpenAL's updates may have been taken at
  // once.
  EXPECT_GE(took.count(), 0.2);
  EXPECT_EQ(sut_->sample_frames_written(), 12U * 1600U);
}

TEST_F(PlaybackTest, DeviceThatRanDryPlaysOnAndCounts) {
  ASSERT_EQ(sut_->write(kVideoFrame), rt::Status::ok);
  ASSERT_EQ(sut_->write(kVideoFrame), rt::Status::ok);
  for (int wait = 0; wait < 100 && sut_->underruns() == 0; ++wait) {
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    ASSERT_NE(write_when_there_is_room(kVideoFrame), -1);
  }
  EXPECT_EQ(sut_->underruns(), 1U);
  for (int frame = 0; frame < 6; ++frame) EXPECT_GE(write_when_there_is_room(kVideoFrame), 0);
}

TEST_F(PlaybackTest, WriteLongerThanTheQueueIsRefused) {
  EXPECT_EQ(sut_->write(std::vector<float>(2 * 4801)), rt::Status::unsupported);
  EXPECT_EQ(sut_->sample_frames_written(), 0U);
}

TEST_F(PlaybackTest, QueueWithoutSizeIsRefusedWithOneSentence) {
  PlaybackConfig config;
  config.buffers_before_start = 11;
  const auto refused = Playback::create(config);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, rt::ExitCode::bad_usage);
}

}  // namespace
}  // namespace tactus::hal::openal
