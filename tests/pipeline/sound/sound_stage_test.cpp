// From impacts to the samples at two ears, through the real mixer.
#include "pipeline/sound/sound_stage.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <vector>

#include "hal/openal/loopback_mixer.hpp"
#include "pipeline/sound/impact_sound.hpp"
#include "tests/pipeline/sound/planned_stage.hpp"
#include "tests/pipeline/sound/shoebox.hpp"
#include "tests/pipeline/sound/signal.hpp"

namespace tactus::sound {
namespace {

using test::impact_of;
using test::level_head;
using test::PlannedStage;

class SoundStageTest : public testing::Test {
 protected:
  void SetUp() override {
    auto created = hal::openal::LoopbackMixer::create();
    if (!created) GTEST_SKIP() << created.error().message;
    mixer_.emplace(std::move(*created));
  }

  std::vector<float> heard(SoundStage& sut, int blocks, const Vec3d& listener = {0, 1.5, 0}) {
    std::vector<float> all, block(2 * 1600);
    for (int i = 0; i < blocks; ++i) {
      EXPECT_EQ(sut.step(level_head(listener), *mixer_, block), rt::Status::ok);
      all.insert(all.end(), block.begin(), block.end());
    }
    return all;
  }

  std::optional<hal::openal::LoopbackMixer> mixer_;
};

std::vector<float> ear(const std::vector<float>& stereo, std::size_t side) {
  std::vector<float> mono;
  for (std::size_t i = side; i < stereo.size(); i += 2) mono.push_back(stereo[i]);
  return mono;
}

std::size_t onset(const std::vector<float>& stereo) {
  const float least = 0.03F * test::loudest(stereo);
  for (std::size_t i = 0; i < stereo.size(); ++i)
    if (std::abs(stereo[i]) > least) return i / 2;
  return stereo.size();
}

TEST_F(SoundStageTest, ContactIsHeardAtItsSamplePlusTheWayThroughTheAir) {
  for (const double distance_m : {0.3, 1.0, 4.0})
    for (const double delay_ms : {0.0, 7.0, 31.0}) {
      PlannedStage planned;
      Impact impact = impact_of("glass", "ceramic", {0, 1.5, -distance_m});
      impact.delay = rt::Duration{static_cast<std::int64_t>(delay_ms * 1e6)};
      EXPECT_EQ(planned.stage.add(impact), rt::Status::ok);
      const auto samples = heard(planned.stage, 4);
      const double expected = 48 * delay_ms + 48000 * distance_m / 343;
      EXPECT_NEAR(static_cast<double>(onset(samples)), expected, 48)
          << distance_m << " m, " << delay_ms << " ms";
      heard(planned.stage, 40);  // what rings on ends before the next
    }
}

TEST_F(SoundStageTest, ContactAtTheLeft_LouderInTheLeftEar) {
  for (const double x : {-1.0, 1.0}) {
    PlannedStage planned;
    EXPECT_EQ(planned.stage.add(impact_of("wood", "wood", {x, 1.5, 0})), rt::Status::ok);
    const auto samples = heard(planned.stage, 30);
    const double left_to_right_db =
        10 * std::log10(test::energy(ear(samples, 0)) / test::energy(ear(samples, 1)));
    EXPECT_GT(-x * left_to_right_db, 3) << x;
  }
}

TEST_F(SoundStageTest, GlassIsBrighterThanWood) {
  double centroids_hz[2] = {};
  for (const bool is_glass : {false, true}) {
    PlannedStage planned;
    const char* what = is_glass ? "glass" : "wood";
    EXPECT_EQ(planned.stage.add(impact_of(what, what, {0, 1.5, -1})), rt::Status::ok);
    const auto samples = ear(heard(planned.stage, 40), 0);
    centroids_hz[is_glass ? 1 : 0] = test::centroid_hz(std::span(samples).first(12000));
  }
  EXPECT_GT(centroids_hz[1], 1.8 * centroids_hz[0]);
}

TEST_F(SoundStageTest, CarpetedRoomIsQuieterThanATiledOne) {
  double energies[3] = {};
  int i = 0;
  for (const auto material : {"carpet", "ceramic"}) {
    const test::Shoebox room(test::id_of(material));
    PlannedStage planned(room.rays());
    EXPECT_EQ(planned.stage.add(impact_of("wood", "wood", {0.7, 1, -1.1})), rt::Status::ok);
    energies[i++] = test::energy(heard(planned.stage, 40));
    EXPECT_EQ(planned.stage.counts().sounds, 1U);
    EXPECT_EQ(planned.stage.counts().reflections, 6U);
  }
  PlannedStage open_air;
  EXPECT_EQ(open_air.stage.add(impact_of("wood", "wood", {0.7, 1, -1.1})), rt::Status::ok);
  energies[2] = test::energy(heard(open_air.stage, 40));
  EXPECT_EQ(open_air.stage.counts().reflections, 0U);
  EXPECT_GT(10 * std::log10(energies[1] / energies[0]), 0.5);
  EXPECT_GT(10 * std::log10(energies[1] / energies[2]), 1);
}

TEST_F(SoundStageTest, WallAnswersWhenItsWayIsOver) {
  // One wall at the right, 2 m away: what it sends back comes 2 * 2 m / 343 m/s later than from the contact
  // at the ear.
  test::Shoebox room(test::id_of("ceramic"));
  room.is_mapped = {false, true, false, false, false, false};
  const Vec3d place{0, 1.5, -0.3};
  std::vector<float> both[2];
  for (const bool with_room : {false, true}) {
    PlannedStage planned(with_room ? room.rays() : contact::DistanceField{});
    EXPECT_EQ(planned.stage.add(impact_of("ceramic", "ceramic", place)), rt::Status::ok);
    both[with_room ? 1 : 0] = heard(planned.stage, 40);
  }
  std::vector<float> answer(both[0].size());
  for (std::size_t i = 0; i < answer.size(); ++i) answer[i] = both[1][i] - both[0][i];
  const double path_m = Vec3d{4, 0, -0.3}.norm();
  EXPECT_NEAR(static_cast<double>(onset(answer)), 48000 * path_m / 343, 48);
  EXPECT_GT(test::energy(ear(answer, 1)), 2 * test::energy(ear(answer, 0))) << "from the right";
}

TEST_F(SoundStageTest, MoreThanABlockHolds_LoudestWinAndTheRestAreCounted) {
  PlannedStage planned;
  for (int i = 0; i < 100; ++i) {
    Impact impact = impact_of("ceramic", "wood", {0, 1.5, -1});
    impact.impulse_n_s = 0.01 * (1 + i % 50);
    EXPECT_EQ(planned.stage.add(impact), i < 64 ? rt::Status::ok : rt::Status::full);
  }
  heard(planned.stage, 1);
  EXPECT_EQ(planned.stage.counts().impacts, 100U);
  EXPECT_EQ(planned.stage.counts().sounds, 8U);
  EXPECT_EQ(planned.stage.counts().left_out, 92U);
  heard(planned.stage, 1);
  EXPECT_EQ(planned.stage.counts().sounds, 8U) << "nothing is played twice";
}

TEST_F(SoundStageTest, NearQuietImpactBeatsAFarLouderOne) {
  SoundConfig config;
  config.sounds_max_per_block = 1;
  PlannedStage planned({}, config);
  Impact far = impact_of("ceramic", "ceramic", {0, 1.5, -8});
  Impact near = impact_of("ceramic", "ceramic", {-1, 1.5, 0});
  far.impulse_n_s = 0.3;
  near.impulse_n_s = 0.1;
  EXPECT_EQ(planned.stage.add(far), rt::Status::ok);
  EXPECT_EQ(planned.stage.add(near), rt::Status::ok);
  const auto samples = heard(planned.stage, 6);
  EXPECT_LT(onset(samples), 200U) << "the far one would come after 23 ms";
}

TEST_F(SoundStageTest, VoicesRunShort_ReflectionsAreLeftOutBeforeSounds) {
  const test::Shoebox room(test::id_of("ceramic"));
  PlannedStage planned(room.rays());
  int block = 0;
  for (; block < 3; ++block) {
    for (int i = 0; i < 8; ++i)
      EXPECT_EQ(planned.stage.add(impact_of("glass", "glass", {0.1 * i, 1, -1})), rt::Status::ok);
    heard(planned.stage, 1);
  }
  EXPECT_EQ(planned.stage.counts().sounds + planned.stage.counts().left_out, 24U);
  EXPECT_EQ(mixer_->voices_free(), 0);
  EXPECT_GE(planned.stage.counts().sounds, 16U);
  EXPECT_GT(planned.stage.counts().reflections_left_out, 0U);
}

TEST_F(SoundStageTest, QuietOrImpossibleImpacts_NotPlayed) {
  PlannedStage planned;
  Impact quiet = impact_of("wood", "wood", {0, 1.5, -1});
  quiet.impulse_n_s = 1e-9;
  EXPECT_EQ(planned.stage.add(quiet), rt::Status::ok);
  Impact broken = impact_of("wood", "wood", {NAN, 1.5, -1});
  EXPECT_EQ(planned.stage.add(broken), rt::Status::skipped);
  Impact still = impact_of("wood", "wood", {0, 1.5, -1});
  still.impact_speed_m_per_s = 0;
  EXPECT_EQ(planned.stage.add(still), rt::Status::skipped);
  EXPECT_EQ(test::loudest(heard(planned.stage, 2)), 0);
  EXPECT_EQ(planned.stage.counts().inaudible, 3U);
}

TEST_F(SoundStageTest, PoseThatIsNoNumber_ListenerStaysWhereItWas) {
  PlannedStage planned;
  heard(planned.stage, 1);
  EXPECT_EQ(planned.stage.add(impact_of("wood", "wood", {-1, 1.5, 0})), rt::Status::ok);
  const auto samples = heard(planned.stage, 6, {NAN, 0, 0});
  EXPECT_GT(test::energy(ear(samples, 0)), 2 * test::energy(ear(samples, 1)));
}

TEST_F(SoundStageTest, TwoBodiesMeet_TheSmallerOtherSoundsHigher) {
  double centroids_hz[2] = {};
  for (const bool is_small : {false, true}) {
    PlannedStage planned;
    Impact impact = impact_of("metal", "glass", {0, 1.5, -1});
    impact.surface_size_m = is_small ? 0.08 : 0;
    EXPECT_EQ(planned.stage.add(impact), rt::Status::ok);
    const auto samples = ear(heard(planned.stage, 40), 0);
    centroids_hz[is_small ? 1 : 0] = test::centroid_hz(std::span(samples).first(12000));
  }
  EXPECT_GT(centroids_hz[1], 1.5 * centroids_hz[0]);
}

TEST_F(SoundStageTest, UnknownMaterials_StillHeard) {
  PlannedStage planned;
  Impact impact = impact_of("wood", "wood", {0, 1.5, -1});
  impact.body_material = impact.surface_material = kUnknownMaterial;
  EXPECT_EQ(planned.stage.add(impact), rt::Status::ok);
  EXPECT_GT(test::loudest(heard(planned.stage, 4)), 0.001F);
}

TEST_F(SoundStageTest, SameImpacts_SameBits) {
  std::vector<float> runs[2];
  const test::Shoebox room;
  for (auto& run : runs) {
    auto mixer = hal::openal::LoopbackMixer::create();
    ASSERT_TRUE(mixer);
    mixer_.emplace(std::move(*mixer));
    PlannedStage planned(room.rays());
    for (int i = 0; i < 5; ++i)
      EXPECT_EQ(planned.stage.add(impact_of("glass", "wood", {0.2 * i, 1, -1})), rt::Status::ok);
    run = heard(planned.stage, 10);
  }
  EXPECT_EQ(runs[0], runs[1]);
}

TEST(BlockSizes, ThirtyFramesASecond_1600Each) {
  BlockSizes sut;
  for (int i = 0; i < 1000; ++i) EXPECT_EQ(sut.next(rt::Duration{33'333'333}), 1600U);
}

TEST(BlockSizes, OtherRates_AddUpToTheTime) {
  for (const double rate_hz : {29.97, 24.0, 59.94, 72.0, 90.0, 7.0}) {
    BlockSizes sut;
    const rt::Duration block{static_cast<std::int64_t>(1e9 / rate_hz)};
    std::uint64_t sum = 0;
    for (int i = 1; i <= 2000; ++i) {
      sum += sut.next(block);
      EXPECT_NEAR(static_cast<double>(sum), i * block.seconds() * 48000, 0.51) << rate_hz;
    }
  }
  BlockSizes sut;
  EXPECT_EQ(sut.next(rt::Duration{-5}), 0U);
}

}  // namespace
}  // namespace tactus::sound
