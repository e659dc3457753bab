#include "rt/watchdog.hpp"

#include <gtest/gtest.h>

#include <thread>

namespace tactus::rt {
namespace {

TEST(Watchdog, TellsWhoIsLateAndByHowMuch) {
  Watchdog sut;
  const std::size_t fast = sut.add("fast", 10_ms);
  const std::size_t slow = sut.add("slow", 100_ms);
  sut.check_in(fast, HostTime{0});
  sut.check_in(slow, HostTime{0});
  EXPECT_TRUE(sut.poll(HostTime{} + 10_ms).empty()) << "exactly in time is in time";
  const auto late = sut.poll(HostTime{} + 11_ms);
  ASSERT_EQ(late.size(), 1U);
  EXPECT_STREQ(late[0].name, "fast");
  EXPECT_EQ(late[0].silent_for, 11_ms);
  sut.check_in(fast, HostTime{} + 95_ms);
  const auto later = sut.poll(HostTime{} + 101_ms);
  ASSERT_EQ(later.size(), 1U);
  EXPECT_STREQ(later[0].name, "slow");
}

TEST(Watchdog, WatchesFromFirstCheckInToGoodbye) {
  Watchdog sut;
  const std::size_t thread = sut.add("thread", 1_ms);
  EXPECT_TRUE(sut.poll(HostTime{} + 1_s).empty());
  sut.check_in(thread, HostTime{});
  EXPECT_EQ(sut.poll(HostTime{} + 1_s).size(), 1U);
  sut.say_goodbye(thread);
  EXPECT_TRUE(sut.poll(HostTime{} + 1_s).empty());
}

TEST(Watchdog, StressCheckInsFromAnotherThreadAreSeen) {
  Watchdog sut;
  const std::size_t thread = sut.add("thread", 5_ns);
  sut.check_in(thread, HostTime{0});
  std::thread other([&] {
    for (std::int64_t t = 1; t <= 10'000; ++t) sut.check_in(thread, HostTime{t});
  });
  Duration silence_before = 20'000_ns;
  while (!sut.poll(HostTime{10'005}).empty()) {
    const auto late = sut.poll(HostTime{10'005});
    if (late.empty()) break;
    EXPECT_LE(late[0].silent_for, silence_before) << "time ran back";
    silence_before = late[0].silent_for;
    std::this_thread::yield();
  }
  other.join();
  EXPECT_TRUE(sut.poll(HostTime{10'005}).empty());
}

TEST(WatchdogDeathTest, UnknownThreadIsABug) {
  Watchdog sut;
  EXPECT_DEATH(sut.check_in(0, HostTime{}), "thread_index");
}

}  // namespace
}  // namespace tactus::rt
