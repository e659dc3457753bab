#include "pipeline/segment/keyframe_policy.hpp"

#include <gtest/gtest.h>

#include <cstdio>
#include <random>

namespace tactus::segment {
namespace {

using enum KeyframeVerdict;

KeyframeRules adaptive_rules() {
  KeyframeRules rules;
  rules.policy = KeyframePolicy::adaptive;
  return rules;
}

/// Long after the last keyframe, standing still, everything known well.
KeyframeFacts nothing_to_gain() {
  KeyframeFacts facts;
  facts.frames_since_last = 1000;
  facts.motion_px = 0.0f;
  return facts;
}

class RandomFacts {
 public:
  explicit RandomFacts(std::uint32_t seed) : random_(seed) { std::printf("seed %u\n", seed); }
  float share() { return std::uniform_real_distribution<float>(0, 1)(random_) * (chance() ? 1.0f : 0.1f); }
  bool chance() { return std::uniform_int_distribution<int>(0, 1)(random_) == 1; }
  KeyframeFacts facts() {
    KeyframeFacts facts;
    if (below(10) > 0) facts.frames_since_last = below(40);
    facts.frames_waited = below(12);
    facts.new_share = share();
    facts.weak_share = share();
    facts.old_share = share();
    facts.view_change_share = share();
    if (below(5) > 0) facts.motion_px = 20 * share();
    return facts;
  }
  std::uint32_t below(std::uint32_t n) {
    return std::uniform_int_distribution<std::uint32_t>(0, n - 1)(random_);
  }

 private:
  std::mt19937 random_;
};

TEST(KeyframePolicyEvery, LooksAtTheDistanceAlone) {
  RandomFacts random(20261122);
  for (int i = 0; i < 20000; ++i) {
    KeyframeRules sut;
    sut.every_frames = 1 + random.below(30);
    const KeyframeFacts facts = random.facts();
    const bool is_due = !facts.frames_since_last || *facts.frames_since_last >= sut.every_frames;
    ASSERT_EQ(judge_keyframe(sut, facts), is_due ? take : not_needed);
  }
}

TEST(KeyframePolicyAdaptive, NeedIsASumOfSharesOverWhatIsEnough) {
  KeyframeRules sut = adaptive_rules();
  sut.new_share = 0.25f;
  sut.weak_share = 0.5f;
  sut.old_share = 0.5f;
  sut.view_change_share = 0.125f;
  KeyframeFacts facts = nothing_to_gain();
  EXPECT_EQ(keyframe_need(sut, facts), 0.0f);
  facts.new_share = 0.0625f;  // a quarter of enough
  facts.old_share = 0.125f;   // another
  facts.weak_share = 0.5f;    // enough, were the view another
  EXPECT_EQ(keyframe_need(sut, facts), 0.5f);
  facts.view_change_share = 0.0625f;  // half of the way there
  EXPECT_EQ(keyframe_need(sut, facts), 1.0f);
  EXPECT_EQ(judge_keyframe(sut, facts), take);
  facts.view_change_share = 0.9f;
  EXPECT_EQ(keyframe_need(sut, facts), 1.5f) << "a view cannot be more than another one";
  facts.view_change_share = 0.0625f;
  facts.old_share = 0.12f;
  EXPECT_EQ(judge_keyframe(sut, facts), not_needed);
}

TEST(KeyframePolicyAdaptive, NothingToGainIsNeverTaken) {
  RandomFacts random(7);
  for (int i = 0; i < 5000; ++i) {
    KeyframeFacts facts = random.facts();
    facts.new_share = facts.old_share = 0;
    facts.view_change_share = 0;
    if (!facts.frames_since_last) facts.weak_share = 0;
    ASSERT_EQ(judge_keyframe(adaptive_rules(), facts), not_needed);
  }
}

TEST(KeyframePolicyAdaptive, FirstFrameIsTakenAtOnce) {
  KeyframeFacts facts;
  facts.new_share = 0.9f;
  EXPECT_EQ(judge_keyframe(adaptive_rules(), facts), take) << "no frame before it tells of motion";
}

TEST(KeyframePolicyAdaptive, FirstSharpFrameIsTakenAndABlurredOneOnlyAtTheBound) {
  KeyframeRules sut = adaptive_rules();
  sut.blur_max_px = 4;
  sut.exposure_share = 0.5f;
  sut.wait_max_frames = 3;
  KeyframeFacts facts = nothing_to_gain();
  facts.new_share = 0.9f;
  facts.motion_px = 8.0f;
  EXPECT_EQ(judge_keyframe(sut, facts), take) << "4 pixels during the exposure are sharp enough";
  facts.motion_px = 8.5f;
  for (facts.frames_waited = 0; facts.frames_waited < 3; ++facts.frames_waited)
    EXPECT_EQ(judge_keyframe(sut, facts), wait) << facts.frames_waited;
  EXPECT_EQ(judge_keyframe(sut, facts), take);
  facts.frames_waited = 0;
  facts.motion_px.reset();
  EXPECT_EQ(judge_keyframe(sut, facts), wait)
      << "motion unknown, as after a search: the next frame will know";
}

TEST(KeyframePolicyAdaptive, HoldsItsPromisesForAnyFacts) {
  RandomFacts random(20261123);
  int taken_count = 0, waited_count = 0;
  for (int i = 0; i < 50000; ++i) {
    KeyframeRules sut = adaptive_rules();
    sut.gap_min_frames = 1 + random.below(20);
    sut.wait_max_frames = random.below(12);
    sut.new_share = 0.02f + random.share();
    const KeyframeFacts facts = random.facts();
    const KeyframeVerdict verdict = judge_keyframe(sut, facts);
    ASSERT_EQ(judge_keyframe(sut, facts), verdict);
    taken_count += verdict == take ? 1 : 0;
    waited_count += verdict == wait ? 1 : 0;
    const bool is_early = facts.frames_since_last && *facts.frames_since_last < sut.gap_min_frames;
    const bool is_over = facts.frames_waited >= sut.wait_max_frames;
    const bool is_blurred = facts.motion_px && *facts.motion_px * sut.exposure_share > sut.blur_max_px;
    if (is_early) {
      ASSERT_EQ(verdict, not_needed);
    }
    if (is_over) {
      ASSERT_NE(verdict, wait) << "the wait is bounded";
    }
    if (is_blurred && !is_over) {
      ASSERT_NE(verdict, take);
    }
    // More to gain never makes a frame less wanted.
    KeyframeFacts more = facts;
    float KeyframeFacts::*const shares[] = {&KeyframeFacts::new_share, &KeyframeFacts::weak_share,
                                            &KeyframeFacts::old_share, &KeyframeFacts::view_change_share};
    more.*shares[random.below(4)] += random.share();
    ASSERT_GE(keyframe_need(sut, more), keyframe_need(sut, facts));
    ASSERT_GE(judge_keyframe(sut, more), verdict);
  }
  EXPECT_GT(taken_count, 1000);
  EXPECT_GT(waited_count, 1000);
}

}  // namespace
}  // namespace tactus::segment
