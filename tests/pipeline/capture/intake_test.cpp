#include "pipeline/capture/intake.hpp"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace tactus {
namespace {

constexpr std::int64_t kInterval = 33'333'333;

hal::FrameHeader frame(std::uint64_t sequence, std::int64_t time_ns, std::int64_t arrived_ns = 0) {
  hal::FrameHeader header;
  header.sequence = sequence;
  header.time = {time_ns};
  header.arrived = {arrived_ns};
  return header;
}

hal::FrameHeader regular(std::uint64_t sequence) {
  return frame(sequence, 1'000'000'000 + static_cast<std::int64_t>(sequence) * kInterval);
}

/// Takes the frames 0 .. count - 1 of a camera in order.
Intake after_regular(std::uint64_t count) {
  Intake intake;
  intake.configure(30);
  for (std::uint64_t i = 0; i < count; ++i) {
    hal::FrameHeader header = regular(i);
    EXPECT_EQ(intake.check(header), rt::Status::ok);
    EXPECT_EQ(header.time, regular(i).time);
  }
  return intake;
}

TEST(Intake, RegularFramesPassUntouched) {
  const Intake sut = after_regular(100);
  EXPECT_EQ(sut.counts().rejected(), 0U);
  EXPECT_EQ(sut.counts().gaps, 0U);
  EXPECT_EQ(sut.counts().times_repaired, 0U);
  EXPECT_EQ(sut.counts().time_jumps, 0U);
}

TEST(Intake, DuplicateIsRejectedAndCounted) {
  Intake sut = after_regular(5);
  hal::FrameHeader again = regular(4);
  EXPECT_EQ(sut.check(again), rt::Status::stale);
  hal::FrameHeader next = regular(5);
  EXPECT_EQ(sut.check(next), rt::Status::ok);
  EXPECT_EQ(sut.counts().duplicates, 1U);
}

TEST(Intake, SwappedNeighboursCostTheEarlierOne) {
  Intake sut = after_regular(5);
  hal::FrameHeader later = regular(6), earlier = regular(5), next = regular(7);
  EXPECT_EQ(sut.check(later), rt::Status::ok);
  EXPECT_EQ(sut.check(earlier), rt::Status::stale);
  EXPECT_EQ(sut.check(next), rt::Status::ok);
  EXPECT_EQ(sut.counts().out_of_order, 1U);
  EXPECT_EQ(sut.counts().gaps, 1U) << "5 did not come in its place";
}

TEST(Intake, LeftOutNumbersAreCounted) {
  Intake sut = after_regular(5);
  hal::FrameHeader next = regular(9);
  EXPECT_EQ(sut.check(next), rt::Status::ok);
  EXPECT_EQ(next.time, regular(9).time);
  EXPECT_EQ(sut.counts().gaps, 4U);
}

TEST(Intake, ClockThatStandsStillIsReplacedByTheNumbersUntilItRuns) {
  Intake sut = after_regular(10);
  for (std::uint64_t i = 10; i < 20; ++i) {
    hal::FrameHeader header = regular(i);
    header.time = regular(9).time;
    EXPECT_EQ(sut.check(header), rt::Status::ok);
    EXPECT_NEAR(static_cast<double>(header.time.ns), static_cast<double>(regular(i).time.ns), 1e3);
  }
  hal::FrameHeader header = regular(20);
  EXPECT_EQ(sut.check(header), rt::Status::ok);
  EXPECT_EQ(header.time, regular(20).time) << "the clock runs again and is believed";
  EXPECT_EQ(sut.counts().times_repaired, 10U);
  EXPECT_EQ(sut.counts().time_jumps, 0U);
}

TEST(Intake, ClockThatLeapsBackGoesOnWithoutTheLeap) {
  Intake sut = after_regular(10);
  constexpr std::int64_t kLeap = -7'000'000'000;
  for (std::uint64_t i = 10; i < 40; ++i) {
    hal::FrameHeader header = regular(i);
    header.time.ns += kLeap;
    EXPECT_EQ(sut.check(header), rt::Status::ok);
    EXPECT_NEAR(static_cast<double>(header.time.ns), static_cast<double>(regular(i).time.ns), 1e3);
  }
  EXPECT_EQ(sut.counts().times_repaired, 2U) << "the second one proves it";
  EXPECT_EQ(sut.counts().time_jumps, 1U);
}

TEST(Intake, ClockThatLeapsForwardIsBelievedUnlessTheHostContradicts) {
  constexpr std::int64_t kLeap = 5'000'000'000;
  Intake alone = after_regular(10);
  hal::FrameHeader paused = regular(10);
  paused.time.ns += kLeap;
  EXPECT_EQ(alone.check(paused), rt::Status::ok);
  EXPECT_EQ(paused.time.ns, regular(10).time.ns + kLeap) << "nobody knows better: a pause";
  EXPECT_EQ(alone.counts().time_jumps, 1U);

  Intake sut;
  sut.configure(30);
  for (std::uint64_t i = 0; i < 40; ++i) {
    hal::FrameHeader header = regular(i);
    header.arrived = {header.time.ns + 90'000'000'000};
    const std::int64_t true_ns = header.time.ns;
    if (i >= 10) header.time.ns += kLeap;
    EXPECT_EQ(sut.check(header), rt::Status::ok);
    EXPECT_NEAR(static_cast<double>(header.time.ns), static_cast<double>(true_ns), 1e3);
  }
  EXPECT_EQ(sut.counts().times_repaired, 2U);
  EXPECT_EQ(sut.counts().time_jumps, 1U);
}

TEST(Intake, OneWrongTimeMovesNothingElse) {
  Intake sut = after_regular(10);
  hal::FrameHeader wrong = regular(10);
  wrong.time.ns -= 200'000'000;
  EXPECT_EQ(sut.check(wrong), rt::Status::ok);
  EXPECT_NEAR(static_cast<double>(wrong.time.ns), static_cast<double>(regular(10).time.ns), 1e3);
  hal::FrameHeader next = regular(11);
  EXPECT_EQ(sut.check(next), rt::Status::ok);
  EXPECT_EQ(next.time, regular(11).time);
  EXPECT_EQ(sut.counts().time_jumps, 0U);
}

TEST(Intake, DeviceThatCountsAnewIsTaken) {
  Intake sut = after_regular(200);
  hal::FrameHeader anew = regular(200);
  anew.sequence = 0;
  EXPECT_EQ(sut.check(anew), rt::Status::ok);
  EXPECT_EQ(sut.counts().rejected(), 0U);
  EXPECT_EQ(sut.counts().gaps, 0U);
}

TEST(Intake, AnyHeadersWhateverTheyHold_TimesHandedOnRise) {
  std::mt19937_64 random(20261130);
  SCOPED_TRACE("seed 20261130");
  Intake sut;
  sut.configure(30);
  std::int64_t last_ns = std::numeric_limits<std::int64_t>::min();
  std::uint64_t taken = 0, seen = 0;
  for (; seen < 20'000; ++seen) {
    hal::FrameHeader header = frame(random() % 4 == 0 ? random() % 500 : taken + random() % 3,
                                    static_cast<std::int64_t>(random() % 20'000'000'000),
                                    random() % 2 == 0 ? 0 : static_cast<std::int64_t>(random() % 20'000'000'000));
    if (sut.check(header) != rt::Status::ok) continue;
    if (taken > 0) {
      ASSERT_GT(header.time.ns, last_ns) << "frame " << seen;
    }
    last_ns = header.time.ns;
    ++taken;
  }
  EXPECT_EQ(taken + sut.counts().rejected(), seen);
}

}  // namespace
}  // namespace tactus
