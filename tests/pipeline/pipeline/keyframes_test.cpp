// Which frames the pipeline takes for keyframes, by need and one in N.
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "tests/pipeline/pipeline/scripted_session.hpp"

namespace tactus {
namespace {

using test::ScriptedSession;

PipelineSetup adaptive() {
  PipelineSetup setup;
  setup.profile.keyframes.policy = segment::KeyframePolicy::adaptive;
  return setup;
}

/// `count` frames from `first` of the path on, `step` of its frames apart.
void go(std::vector<int>& script, int first, int step, int count) {
  for (int i = 0; i < count; ++i) script.push_back(first + i * step);
}

TEST(PipelineKeyframes, StandingStillNeedsOneWhereOneInTwelveTakesTen) {
  std::vector<int> script;
  go(script, 0, 0, 110);
  EXPECT_EQ(ScriptedSession(script, adaptive()).keyframes(), std::vector<int>{0});
  const std::vector<int> every = {0, 12, 24, 36, 48, 60, 72, 84, 96, 108};
  EXPECT_EQ(ScriptedSession(script, PipelineSetup{}).keyframes(), every);
}

TEST(PipelineKeyframes, OldLabelsAreRenewed) {
  std::vector<int> script;
  go(script, 0, 0, 60);
  PipelineSetup setup = adaptive();
  setup.profile.keyframes.old_frames = 30;
  const std::vector<int> taken = ScriptedSession(script, setup).keyframes();
  ASSERT_EQ(taken.size(), 2u);
  // Its labels reach the map a few frames after it was taken, and their age counts from there.
  EXPECT_GE(taken[1], 30);
  EXPECT_LE(taken[1], 45);
}

TEST(PipelineKeyframes, NewSurfaceIsTakenAtOnceAndOnce) {
  std::vector<int> script;
  go(script, 0, 0, 40);
  go(script, 90, 0, 40);
  const std::vector<int> taken = ScriptedSession(script, adaptive()).keyframes();
  // The frame of the jump itself is blurred beyond use; the next stands still.
  EXPECT_EQ(taken, (std::vector<int>{0, 41}));
}

TEST(PipelineKeyframes, SweepThatIsSharpTakesThemByNeedNeverCloserThanTheGap) {
  std::vector<int> script;
  go(script, 20, 1, 120);
  const PipelineSetup setup = adaptive();
  const std::vector<int> taken = ScriptedSession(script, setup).keyframes();
  EXPECT_GE(taken.size(), 3u) << "the room comes into view bit by bit";
  for (std::size_t i = 1; i < taken.size(); ++i)
    EXPECT_GE(taken[i] - taken[i - 1], static_cast<int>(setup.profile.keyframes.gap_min_frames)) << i;
}

TEST(PipelineKeyframes, FastTurnIsTakenOnlyAtTheBoundOrWhenItEnds) {
  constexpr int kStill = 20, kTurning = 14;
  std::vector<int> script;
  go(script, 20, 0, kStill);
  go(script, 20, 8, kTurning);  // eight times as fast as a hand
  go(script, script.back(), 0, 20);
  PipelineSetup setup = adaptive();
  setup.profile.keyframes.blur_max_px = 1;
  for (const std::uint32_t bound : {4u, 8u, 1000u}) {
    setup.profile.keyframes.wait_max_frames = bound;
    const std::vector<int> taken = ScriptedSession(script, setup).keyframes();
    ASSERT_GE(taken.size(), 2u) << bound;
    EXPECT_EQ(taken[0], 0);
    if (bound < kTurning) {
      EXPECT_GE(taken[1], kStill + static_cast<int>(bound)) << bound;
      EXPECT_LE(taken[1], kStill + static_cast<int>(bound) + 3)
          << bound << ": a few frames until enough is new";
    } else {
      EXPECT_EQ(taken[1], kStill + kTurning) << "the first frame that stands still";
    }
  }
}

TEST(PipelineKeyframes, LockstepRepeatsBitForBit) {
  std::vector<int> script;
  go(script, 0, 2, 40);
  std::vector<int> taken[2];
  map::Map::Hash hash[2];
  for (int i = 0; i < 2; ++i) {
    ScriptedSession session(script, adaptive());
    taken[i] = session.keyframes();
    hash[i] = session.pipeline->spine().map().hash_content();
  }
  EXPECT_GE(taken[0].size(), 2u);
  EXPECT_EQ(taken[0], taken[1]);
  EXPECT_EQ(hash[0].labels, hash[1].labels);
  EXPECT_EQ(hash[0].geometry, hash[1].geometry);
}

}  // namespace
}  // namespace tactus
