#include "rt/clock.hpp"

#include <gtest/gtest.h>

namespace tactus::rt {
namespace {

TEST(Clock, MonotonicNeverRunsBack) {
  const Clock sut = Clock::monotonic();
  HostTime before = sut.now();
  for (int i = 0; i < 1000; ++i) {
    const HostTime after = sut.now();
    ASSERT_GE(after, before);
    before = after;
  }
}

TEST(Clock, SleepUntilReturnsNotBeforeTheTime) {
  const Clock sut = Clock::monotonic();
  const HostTime when = sut.now() + 2_ms;
  sut.sleep_until(when);
  EXPECT_GE(sut.now(), when);
}

TEST(Clock, SleepUntilThePastReturnsAtOnce) {
  const Clock sut = Clock::monotonic();
  sut.sleep_until(HostTime{-5});
  sut.sleep_until(sut.now() - 1_s);
  SUCCEED() << "an endless wait would end in the test's time-out";
}

TEST(ManualClock, MovesOnlyWhenTold) {
  ManualClock manual(HostTime{100});
  const Clock sut = Clock::manual(manual);
  EXPECT_EQ(sut.now(), HostTime{100});
  manual.advance(5_us);
  EXPECT_EQ(sut.now(), HostTime{5100});
  manual.set(HostTime{7});
  EXPECT_EQ(sut.now(), HostTime{7});
}

TEST(ManualClock, SleepUntilMovesItForwardAndNeverBack) {
  ManualClock manual;
  const Clock sut = Clock::manual(manual);
  sut.sleep_until(HostTime{50});
  EXPECT_EQ(sut.now(), HostTime{50});
  sut.sleep_until(HostTime{20});
  EXPECT_EQ(sut.now(), HostTime{50});
}

}  // namespace
}  // namespace tactus::rt
