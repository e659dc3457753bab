#include "hal/replay/lists.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace tactus::hal::replay {
namespace {

using Fault = ListEntry::Fault;

FrameList parse(std::string_view text) {
  auto list = parse_frame_list(text, "depth.txt");
  EXPECT_TRUE(list.has_value());
  return list ? *list : FrameList{};
}

std::string error_of(std::string_view text) {
  auto list = parse_frame_list(text, "depth.txt");
  EXPECT_FALSE(list.has_value());
  if (list) return {};
  EXPECT_EQ(list.error().code, rt::ExitCode::bad_input);
  return list.error().message;
}

std::vector<Fault> faults_of(const FrameList& list) {
  std::vector<Fault> out;
  for (const ListEntry& entry : list.entries) out.push_back(entry.fault);
  return out;
}

TEST(FrameList, LinesBecomeEntriesWithExactTimes) {
  const FrameList sut =
      parse("# comment\n1305031229.528784 depth/a b.png \r\n\n1305031229.564442\tdepth/c.png");
  ASSERT_EQ(sut.entries.size(), 2U);
  EXPECT_EQ(sut.entries[0].time.ns, 1305031229528784000);
  EXPECT_EQ(sut.entries[0].path, "depth/a b.png");
  EXPECT_EQ(sut.entries[0].line, 2);
  EXPECT_EQ(sut.entries[1].sequence, 1U);
  EXPECT_EQ(sut.entries[1].line, 4);
  EXPECT_TRUE(sut.jumps.empty());
}

TEST(FrameList, GarbledLineIsOneLostFrame) {
  const FrameList sut = parse("0.0 a\nnan b\n0.1\n0.2 c\n");
  EXPECT_EQ(faults_of(sut), (std::vector{Fault::none, Fault::unreadable, Fault::unreadable, Fault::none}));
  EXPECT_EQ(sut.entries[3].sequence, 3U);
}

TEST(FrameList, NothingUsableIsAnErrorWithItsLine) {
  EXPECT_EQ(error_of(""), "depth.txt: the list is empty; it must have one \"timestamp path\" line per frame");
  EXPECT_EQ(error_of("# only\n\n"), error_of(""));
  EXPECT_EQ(error_of("\n\x89PNG\n"),
            "depth.txt:2: \"?PNG\" is not \"timestamp path\", and no other line is either");
}

TEST(FrameList, OneTimeInTheFutureCostsOneFrame) {
  const FrameList sut = parse("1 a\n2 b\n900 c\n3 d\n4 e\n");
  EXPECT_EQ(faults_of(sut),
            (std::vector{Fault::none, Fault::none, Fault::time_not_later, Fault::none, Fault::none}));
}

TEST(FrameList, TimesGoingBackCostTheFewestFrames) {
  const FrameList sut = parse("1 a\n2 b\n3 c\n0.5 d\n0.6 e\n4 f\n");
  EXPECT_EQ(faults_of(sut), (std::vector{Fault::none, Fault::none, Fault::none, Fault::time_not_later,
                                         Fault::time_not_later, Fault::none}));
}

TEST(FrameList, OfEqualTimesTheFirstStays) {
  const FrameList sut = parse("1 a\n1 b\n2 c\n2 d\n2 e\n");
  EXPECT_EQ(faults_of(sut), (std::vector{Fault::none, Fault::time_not_later, Fault::none,
                                         Fault::time_not_later, Fault::time_not_later}));
}

TEST(FrameList, PauseIsKeptAndTold) {
  const FrameList sut = parse("1 a\n1.1 b\n61.1 c\n61.2 d\n");
  ASSERT_EQ(sut.jumps.size(), 1U);
  EXPECT_EQ(sut.jumps[0].sequence, 2U);
  EXPECT_EQ(sut.jumps[0].gap.ns, 60'000'000'000);
  EXPECT_EQ(faults_of(sut), std::vector(4, Fault::none));
}

TEST(LongestIncreasing, AgreesWithTheQuadraticOracle) {
  const unsigned seed = 7;
  SCOPED_TRACE(seed);
  std::mt19937 random(seed);
  for (int round = 0; round < 2000; ++round) {
    std::vector<std::int64_t> times(random() % 14);
    for (auto& time : times) time = static_cast<std::int64_t>(random() % 10);
    std::size_t best = 0;
    std::vector<std::size_t> longest(times.size(), 1);
    for (std::size_t i = 0; i < times.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j)
        if (times[j] < times[i]) longest[i] = std::max(longest[i], longest[j] + 1);
      best = std::max(best, longest[i]);
    }
    const std::vector<bool> kept = longest_increasing(times);
    std::vector<std::int64_t> run;
    for (std::size_t i = 0; i < times.size(); ++i)
      if (kept[i]) run.push_back(times[i]);
    EXPECT_EQ(run.size(), best);
    EXPECT_TRUE(std::adjacent_find(run.begin(), run.end(), std::greater_equal<>()) == run.end());
  }
}

TEST(TimeIndex, FindsTheNearestWithinReach) {
  const FrameList list = parse("1 a\n1.5 b\n9 spike\n2 c\n");
  const TimeIndex sut(list);
  const auto nearest = [&](std::int64_t ms) { return sut.nearest({ms * 1'000'000}, {20'000'000}); };
  EXPECT_EQ(nearest(1015), 0U);
  EXPECT_EQ(nearest(980), 0U);
  EXPECT_EQ(nearest(979), std::nullopt);
  EXPECT_EQ(nearest(1021), std::nullopt);
  EXPECT_EQ(nearest(2000), 3U);
  EXPECT_EQ(nearest(9000), std::nullopt) << "a faulty entry is no partner";
}

}  // namespace
}  // namespace tactus::hal::replay
