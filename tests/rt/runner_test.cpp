#include "rt/runner.hpp"

#include <gtest/gtest.h>

#include <random>
#include <thread>
#include <vector>

#include "tests/rt/aligned_memory.hpp"

namespace tactus::rt {
namespace {

TEST(Cadence, InTimeKeepsTheGrid) {
  Cadence sut(10_ms, HostTime{});
  EXPECT_EQ(sut.arm(HostTime{} + 3_ms), 0U);
  EXPECT_EQ(sut.next(), HostTime{} + 10_ms);
  EXPECT_EQ(sut.arm(HostTime{} + 20_ms), 0U) << "ending exactly when the next begins is in time";
  EXPECT_EQ(sut.next(), HostTime{} + 20_ms);
  EXPECT_EQ(sut.slipped_count(), 0U);
}

TEST(Cadence, LateSkipsAndRearmsFromNow) {
  Cadence sut(10_ms, HostTime{});
  EXPECT_EQ(sut.arm(HostTime{} + 35_ms), 3U) << "the rounds of 10, 20 and 30 ms did not take place";
  EXPECT_EQ(sut.next(), HostTime{} + 45_ms);
  EXPECT_EQ(sut.arm(HostTime{} + 46_ms), 0U);
  EXPECT_EQ(sut.next(), HostTime{} + 55_ms);
  EXPECT_EQ(sut.slipped_count(), 3U);
}

TEST(Cadence, NeverRunsTwiceInOnePeriod) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  Cadence sut(10_ms, HostTime{});
  HostTime before{-1'000'000'000};
  std::uint64_t slipped = 0;
  for (int i = 0; i < 10'000; ++i) {
    const HostTime start = sut.next();
    ASSERT_GE(start - before, 10_ms);
    before = start;
    slipped += sut.arm(start + Duration{static_cast<std::int64_t>(random() % 35'000'000)});
    ASSERT_EQ(sut.slipped_count(), slipped);
  }
  EXPECT_GT(slipped, 0U);
}

TEST(CadenceDeathTest, PeriodOfNothingIsABug) { EXPECT_DEATH(Cadence(0_ns, HostTime{}), "period"); }

class RunStageTest : public testing::Test {
 protected:
  RunStageTest() {
    Slice slice = memory_.slice();
    trace.bind(slice, 8);
  }
  Status run(StageRecord& record, HostTime deadline, Duration takes) {
    return run_stage(record, Clock::manual(manual), deadline, &trace,
                     [&](const StageContext& context) noexcept {
                       ++ran_count;
                       seen = context;
                       manual.advance(takes);
                       return Status::ok;
                     });
  }
  ManualClock manual{HostTime{1000}};
  TraceRing trace;
  StageContext seen;
  int ran_count = 0;

 private:
  test::AlignedMemory memory_{TraceRing::bytes_needed(8)};
};

TEST_F(RunStageTest, MeasuresCountsAndTraces) {
  StageRecord sut("integrate");
  EXPECT_EQ(run(sut, HostTime{1000} + 5_ms, 2_ms), Status::ok);
  EXPECT_EQ(seen.now, HostTime{1000});
  EXPECT_EQ(seen.deadline, HostTime{1000} + 5_ms);
  EXPECT_EQ(sut.latency.max(), 2_ms);
  EXPECT_EQ(sut.statuses.was(Status::ok), 1U);
  EXPECT_EQ(sut.missed_count, 0U);
  ASSERT_EQ(trace.size(), 1U);
  trace.for_each([](const TraceRecord& record) {
    EXPECT_STREQ(record.name, "integrate");
    EXPECT_EQ(record.start, HostTime{1000});
    EXPECT_EQ(record.duration, 2_ms);
  });
}

TEST_F(RunStageTest, LateStageThatGivesWayDoesNotRun) {
  StageRecord sut("refine", WhenLate::skip);
  EXPECT_EQ(run(sut, HostTime{999}, 2_ms), Status::late);
  EXPECT_EQ(ran_count, 0);
  EXPECT_EQ(sut.statuses.was(Status::late), 1U);
  EXPECT_EQ(sut.latency.count(), 0U);
  EXPECT_EQ(trace.size(), 1U);
  EXPECT_EQ(run(sut, HostTime{1000}, 2_ms), Status::ok) << "exactly at the deadline is not late";
}

TEST_F(RunStageTest, LateStageThatMustRunRuns) {
  StageRecord sut("present", WhenLate::run);
  EXPECT_EQ(run(sut, HostTime{999}, 2_ms), Status::ok);
  EXPECT_TRUE(seen.is_late());
  EXPECT_EQ(sut.missed_count, 0U) << "it was late before it began: that is somebody else's fault";
}

TEST_F(RunStageTest, EndingAfterTheDeadlineIsCounted) {
  StageRecord sut("track");
  EXPECT_EQ(run(sut, HostTime{1000} + 1_ms, 2_ms), Status::ok);
  EXPECT_EQ(sut.missed_count, 1U);
}

TEST_F(RunStageTest, NoDeadlineIsNeverLate) {
  StageRecord sut("track", WhenLate::skip);
  EXPECT_EQ(run(sut, kNoDeadline, 1_s), Status::ok);
  EXPECT_EQ(sut.missed_count, 0U);
}

TEST(RunPeriodic, RunsRoundsOnTheCadenceAndSkipsWhenLate) {
  ManualClock manual;
  Cadence cadence(10_ms, HostTime{} + 10_ms);
  std::atomic<bool> is_stopping{false};
  std::vector<HostTime> starts, deadlines;
  run_periodic(cadence, Clock::manual(manual), is_stopping, [&](HostTime now, HostTime deadline) {
    starts.push_back(now);
    deadlines.push_back(deadline);
    manual.advance(starts.size() == 2 ? 25_ms : 1_ms);
    if (starts.size() == 4) is_stopping.store(true);
  });
  // 10, 20 (takes 25: ends at 45, rounds 30 and 40 slip), 55, 65.
  EXPECT_EQ(starts, (std::vector<HostTime>{HostTime{} + 10_ms, HostTime{} + 20_ms, HostTime{} + 55_ms,
                                           HostTime{} + 65_ms}));
  EXPECT_EQ(deadlines[1], HostTime{} + 30_ms);
  EXPECT_EQ(deadlines[2], HostTime{} + 65_ms);
  EXPECT_EQ(cadence.slipped_count(), 2U);
}

TEST(RunPeriodic, StopsWhenAskedByAnotherThread) {
  const Clock clock = Clock::monotonic();
  Cadence cadence(1_ms, clock.now());
  std::atomic<bool> is_stopping{false};
  std::atomic<int> rounds_count{0};
  std::thread periodic([&] {
    run_periodic(cadence, clock, is_stopping, [&](HostTime now, HostTime) {
      // Never early. How late is the machine's affair, not a unit test's.
      if (now < cadence.next()) rounds_count.store(1'000'000);
      rounds_count.fetch_add(1);
    });
  });
  while (rounds_count.load() < 5) std::this_thread::yield();
  is_stopping.store(true, std::memory_order_release);
  periodic.join();
  EXPECT_LT(rounds_count.load(), 1'000'000);
}

}  // namespace
}  // namespace tactus::rt
