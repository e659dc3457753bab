#include "hal/openal/loopback_mixer.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <random>
#include <vector>

namespace tactus::hal::openal {
namespace {

std::vector<float> noise(std::size_t samples_count, float amplitude = 0.2F) {
  std::mt19937 random(7);
  std::vector<float> samples(samples_count);
  for (float& x : samples) x = amplitude * (static_cast<float>(random()) / 2147483648.0F - 1);
  return samples;
}

std::vector<float> mixed(LoopbackMixer& sut, std::size_t sample_frames) {
  std::vector<float> samples(2 * sample_frames);
  EXPECT_EQ(sut.mix(samples), rt::Status::ok);
  return samples;
}

double power_db(const std::vector<float>& samples, std::size_t ear) {
  double sum = 1e-20;
  for (std::size_t i = ear; i < samples.size(); i += 2)
    sum += static_cast<double>(samples[i]) * static_cast<double>(samples[i]);
  return 10 * std::log10(sum);
}

float loudest(const std::vector<float>& samples) {
  float most = 0;
  for (const float x : samples) most = std::max(most, std::abs(x));
  return most;
}

/// First sample frame in which an ear hears a hundredth of the loudest sample.
std::size_t onset(const std::vector<float>& samples) {
  const float least = 0.01F * loudest(samples);
  for (std::size_t i = 0; i < samples.size(); ++i)
    if (std::abs(samples[i]) > least) return i / 2;
  return samples.size();
}

/// A head at the origin of a world whose y is up, looking along -z.
T_WorldDepth level_head() { return {Rotation{{1, 0, 0, 0, -1, 0, 0, 0, -1}}, {}}; }

class LoopbackMixerTest : public testing::Test {
 protected:
  void SetUp() override {
    auto created = LoopbackMixer::create();
    if (!created && created.error().code == rt::ExitCode::device_unavailable)
      GTEST_SKIP() << created.error().message;
    ASSERT_TRUE(created) << created.error().message;
    sut_.emplace(std::move(*created));
    sut_->set_listener(level_head());
  }

  std::vector<float> heard_from(const Vec3d& place, const std::vector<float>& clip = noise(4800)) {
    EXPECT_EQ(sut_->play({clip, place, 1, {}}), rt::Status::ok);
    return mixed(*sut_, clip.size() + 480);
  }

  std::optional<LoopbackMixer> sut_;
};

TEST_F(LoopbackMixerTest, HrtfIsOnHere) {
  EXPECT_TRUE(sut_->has_hrtf());
  EXPECT_EQ(sut_->format().sample_rate_hz, 48000);
}

TEST_F(LoopbackMixerTest, NothingPlays_Silence) {
  EXPECT_EQ(loudest(mixed(*sut_, 1600)), 0);
  heard_from({0, 0, -1});
  EXPECT_EQ(loudest(mixed(*sut_, 1600)), 0) << "after the end of a clip";
}

TEST_F(LoopbackMixerTest, DelayedClipBeginsWithinAMillisecondOfItsSample) {
  // One clip over several blocks of different lengths: each begins where it was asked, also in a later block.
  for (const int delay_samples : {0, 1, 479, 1023, 1024, 1600, 5000}) {
    const std::vector<float> clip = noise(480, 0.3F);
    const rt::Duration delay{delay_samples * 1'000'000'000LL / 48000};
    ASSERT_EQ(sut_->play({clip, {0, 0, -1}, 1, delay}), rt::Status::ok);
    std::vector<float> heard;
    for (const std::size_t block : {1600U, 441U, 1601U, 2400U, 1000U}) {
      const auto samples = mixed(*sut_, block);
      heard.insert(heard.end(), samples.begin(), samples.end());
    }
    EXPECT_GE(onset(heard), static_cast<std::size_t>(delay_samples));
    EXPECT_LE(onset(heard), static_cast<std::size_t>(delay_samples) + 48) << delay_samples;
  }
}

TEST_F(LoopbackMixerTest, TwoClipsKeepTheirDistanceToTheSample) {
  const std::vector<float> click = {0.5F};
  const std::vector<float> first = heard_from({0, 0, -1}, click);
  ASSERT_EQ(sut_->play({click, {0, 0, -1}, 1, rt::Duration{1'000'000'000LL * 1000 / 48000}}), rt::Status::ok);
  const std::vector<float> second = mixed(*sut_, 2000);
  for (std::size_t i = 0; i < 2 * 200; ++i) EXPECT_NEAR(first[i], second[2000 + i], 1e-6F) << i;
}

TEST_F(LoopbackMixerTest, SidesAreHeardBySidesAndMirrored) {
  const auto left = heard_from({-1, 0, 0}), right = heard_from({1, 0, 0});
  EXPECT_GE(power_db(left, 0) - power_db(left, 1), 6);
  EXPECT_GE(power_db(right, 1) - power_db(right, 0), 6);
  EXPECT_NEAR(power_db(left, 0), power_db(right, 1), 1);
  EXPECT_NEAR(power_db(left, 1), power_db(right, 0), 1);
}

TEST_F(LoopbackMixerTest, FrontAndBackReachBothEarsAlike) {
  for (const double z : {-1.0, 1.0}) {
    const auto heard = heard_from({0, 0, z});
    EXPECT_NEAR(power_db(heard, 0), power_db(heard, 1), 1) << z;
  }
}

TEST_F(LoopbackMixerTest, TurnedHeadHearsTheOtherSide) {
  T_WorldDepth turned = level_head();
  turned.rotation = Rotation::from({0, 0, 1, 0}) * turned.rotation;  // half a turn about the vertical
  sut_->set_listener(turned);
  const auto heard = heard_from({-1, 0, 0});
  EXPECT_GE(power_db(heard, 1) - power_db(heard, 0), 6);
}

TEST_F(LoopbackMixerTest, HeadThatMovedHearsFromItsPlace) {
  T_WorldDepth moved = level_head();
  moved.translation = {3, 0.5, 2};
  const auto before = heard_from({-1, 0.2, -0.5});
  sut_->set_listener(moved);
  const auto after = heard_from({2, 0.7, 1.5});
  EXPECT_NEAR(power_db(before, 0), power_db(after, 0), 0.05);
  EXPECT_NEAR(power_db(before, 1), power_db(after, 1), 0.05);
}

TEST_F(LoopbackMixerTest, TwiceTheDistanceIsSixDecibelsDown) {
  const std::vector<float> quiet = noise(4800, 0.02F);
  double before = power_db(heard_from({0, 0, -0.25}, quiet), 0);
  for (const double distance_m : {0.5, 1.0, 2.0, 4.0, 8.0}) {
    const double here = power_db(heard_from({0, 0, -distance_m}, quiet), 0);
    EXPECT_NEAR(here - before, -6.02, 1) << distance_m;
    before = here;
  }
  EXPECT_NEAR(power_db(heard_from({0, 0, -0.2}, quiet), 0), power_db(heard_from({0, 0, -0.05}, quiet), 0),
              0.1);
}

TEST_F(LoopbackMixerTest, GainScalesWhatIsHeard) {
  const std::vector<float> quiet = noise(4800, 0.05F);
  const double one = power_db(heard_from({0, 0, -1}, quiet), 0);
  ASSERT_EQ(sut_->play({quiet, {0, 0, -1}, 0.5F, {}}), rt::Status::ok);
  EXPECT_NEAR(power_db(mixed(*sut_, quiet.size() + 480), 0), one - 6.02, 0.1);
}

TEST_F(LoopbackMixerTest, VoicesRunOut_FullAndCountedUntilOneEnds) {
  const std::vector<float> clip = noise(1000, 0.01F);
  for (int i = 0; i < 64; ++i) ASSERT_EQ(sut_->play({clip, {0, 0, -1}, 1, {}}), rt::Status::ok) << i;
  EXPECT_EQ(sut_->voices_free(), 0);
  EXPECT_EQ(sut_->play({clip, {0, 0, -1}, 1, {}}), rt::Status::full);
  EXPECT_EQ(sut_->clips_left_out(), 1U);
  mixed(*sut_, 1600);
  EXPECT_EQ(sut_->voices_free(), 64);
  EXPECT_EQ(sut_->play({clip, {0, 0, -1}, 1, {}}), rt::Status::ok);
}

TEST_F(LoopbackMixerTest, SameCallsInAnotherMixerOfTheProcess_SameBits) {
  auto other = LoopbackMixer::create();
  ASSERT_TRUE(other);
  const auto perform = [](LoopbackMixer& mixer, std::vector<float>& heard) {
    std::mt19937 random(11);
    const std::vector<float> clip = noise(6000, 0.1F);
    for (int block = 0; block < 12; ++block) {
      T_WorldDepth head = level_head();
      head.translation.x = 0.05 * block;
      mixer.set_listener(head);
      for (int i = 0; i < 3; ++i) {
        const Vec3d place{static_cast<double>(random() % 400) / 100 - 2, 0.1, -1};
        EXPECT_EQ(
            mixer.play({clip, place, 0.5F, rt::Duration{static_cast<std::int64_t>(random() % 33'000'000)}}),
            rt::Status::ok);
      }
      const auto samples = mixed(mixer, 1600);
      heard.insert(heard.end(), samples.begin(), samples.end());
    }
  };
  std::vector<float> here, there;
  perform(*sut_, here);
  perform(*other, there);
  EXPECT_GT(loudest(here), 0.01F);
  EXPECT_EQ(here, there);
}

TEST_F(LoopbackMixerTest, AnotherMixerInTheProcess_HearsNothingOfThis) {
  const std::vector<float> clip = noise(4800);
  {
    auto other = LoopbackMixer::create();
    ASSERT_TRUE(other);
    ASSERT_EQ(sut_->play({clip, {0, 0, -1}, 1, {}}), rt::Status::ok);
    EXPECT_EQ(loudest(mixed(*other, 1600)), 0);
    other->set_listener({});
  }
  const auto heard = mixed(*sut_, 1600);
  EXPECT_GT(loudest(heard), 0.01F) << "also after the other is gone";
  EXPECT_NEAR(power_db(heard, 0), power_db(heard, 1), 1);
}

TEST_F(LoopbackMixerTest, TooMuchSoundIsBentBelowOneAndCounted) {
  const std::vector<float> loud = noise(4800, 1);
  for (int i = 0; i < 10; ++i) ASSERT_EQ(sut_->play({loud, {0, 0, -0.3}, 1, {}}), rt::Status::ok);
  const auto heard = mixed(*sut_, 4800);
  EXPECT_LE(loudest(heard), 1);
  EXPECT_GT(sut_->samples_limited(), 100U);
}

TEST_F(LoopbackMixerTest, ClipsThatCannotBePlayedAreRefused) {
  const std::vector<float> clip = noise(100);
  EXPECT_EQ(sut_->play({{}, {0, 0, -1}, 1, {}}), rt::Status::unsupported);
  EXPECT_EQ(sut_->play({clip, {NAN, 0, -1}, 1, {}}), rt::Status::unsupported);
  EXPECT_EQ(sut_->play({clip, {0, 0, -1}, NAN, {}}), rt::Status::unsupported);
  EXPECT_EQ(sut_->play({clip, {0, 0, -1}, 1, rt::Duration{60'000'000'000}}), rt::Status::unsupported);
  EXPECT_EQ(sut_->voices_free(), 64);
}

TEST(LoopbackMixer, WithoutHrtf_PansAndSaysSo) {
  LoopbackConfig config;
  config.use_hrtf = false;
  auto sut = LoopbackMixer::create(config);
  if (!sut) GTEST_SKIP() << sut.error().message;
  EXPECT_FALSE(sut->has_hrtf());
  sut->set_listener(level_head());
  const std::vector<float> clip = noise(4800);
  ASSERT_EQ(sut->play({clip, {-1, 0, 0}, 1, {}}), rt::Status::ok);
  const auto heard = mixed(*sut, 4800);
  EXPECT_GE(power_db(heard, 0) - power_db(heard, 1), 6);
}

TEST(LoopbackMixer, VoicesThatCannotBeMade_RefusedWithOneSentence) {
  for (const int count : {0, 257}) {
    LoopbackConfig config;
    config.voices_count = count;
    const auto refused = LoopbackMixer::create(config);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, rt::ExitCode::bad_usage);
    EXPECT_NE(refused.error().message.find(std::to_string(count)), std::string::npos);
  }
}

}  // namespace
}  // namespace tactus::hal::openal
