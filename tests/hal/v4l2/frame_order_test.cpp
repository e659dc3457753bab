#include "hal/v4l2/frame_order.hpp"

#include <gtest/gtest.h>

#include <random>
#include <string>

namespace tactus::hal::v4l2 {
namespace {

TEST(V4l2FrameOrder, FirstFrameKeepsTheDriversNumberAndMissesNothing) {
  FrameOrder sut;
  const auto first = sut.next(7);
  EXPECT_EQ(first.sequence, 7U);
  EXPECT_EQ(first.missing_count, 0U);
}

TEST(V4l2FrameOrder, GapsAreMissingFrames) {
  FrameOrder sut;
  (void)sut.next(0);
  EXPECT_EQ(sut.next(1).missing_count, 0U);
  const auto late = sut.next(5);
  EXPECT_EQ(late.sequence, 5U);
  EXPECT_EQ(late.missing_count, 3U);
}

TEST(V4l2FrameOrder, WrapOfTheDriversCounterGoesOn) {
  FrameOrder sut;
  (void)sut.next(0xffff'fffe);
  const auto wrapped = sut.next(1);
  EXPECT_EQ(wrapped.sequence, 0x1'0000'0001U);
  EXPECT_EQ(wrapped.missing_count, 2U);
}

TEST(V4l2FrameOrder, DriverThatDoesNotCountGoesOnByOne) {
  FrameOrder sut;
  (void)sut.next(0);
  EXPECT_EQ(sut.next(0).sequence, 1U);
  const auto third = sut.next(0);
  EXPECT_EQ(third.sequence, 2U);
  EXPECT_EQ(third.missing_count, 0U);
}

TEST(V4l2FrameOrder, RestartKeepsTheNumberRising) {
  FrameOrder sut;
  (void)sut.next(0);
  (void)sut.next(100);
  sut.restart();
  const auto again = sut.next(0);
  EXPECT_EQ(again.sequence, 101U);
  EXPECT_EQ(again.missing_count, 0U);
  EXPECT_EQ(sut.next(2).sequence, 103U);
}

TEST(V4l2FrameOrder, RandomDriversAlwaysRiseAndMissWhatTheyLeaveOut) {
  const std::uint64_t seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937_64 random(seed);
  FrameOrder sut;
  auto driver = static_cast<std::uint32_t>(random());
  std::uint64_t before = sut.next(driver).sequence;
  for (int i = 0; i < 20'000; ++i) {
    const auto ahead = static_cast<std::uint32_t>(random() % 1000 + 1);
    const bool is_restart = random() % 50 == 0;
    driver = is_restart ? static_cast<std::uint32_t>(random()) : driver + ahead;
    if (is_restart) sut.restart();
    const auto number = sut.next(driver);
    ASSERT_EQ(number.sequence, before + (is_restart ? 1 : ahead));
    ASSERT_EQ(number.missing_count, is_restart ? 0 : ahead - 1);
    before = number.sequence;
  }
}

TEST(V4l2Stamp, OutOfRangeIsNoTime) {
  EXPECT_EQ(stamp_ns(12, 345'678), 12'345'678'000);
  EXPECT_EQ(stamp_ns(-1, 0), std::nullopt);
  EXPECT_EQ(stamp_ns(18'446'744'073, 0), std::nullopt) << "2^64 ns";
  EXPECT_EQ(stamp_ns(0, 1'000'000), std::nullopt);
  EXPECT_EQ(stamp_ns(9'223'372'035, 999'999), 9'223'372'035'999'999'000);
}

TEST(V4l2DeviceClock, HostClockIsNeverMoved) {
  DeviceClock sut;
  (void)sut.at(1'000, {1'500}, true);
  sut.restart();
  EXPECT_EQ(sut.at(9'000, {9'700}, true).ns, 9'000);
}

TEST(V4l2DeviceClock, DevicesOwnClockThatStartsAnewGoesOnByTheTimeAway) {
  DeviceClock sut;
  (void)sut.at(5'000, {100'000}, false);
  EXPECT_EQ(sut.at(6'000, {101'000}, false).ns, 6'000);
  sut.restart();
  EXPECT_EQ(sut.at(10, {151'000}, false).ns, 56'000) << "50000 ns after the last, as the host saw it";
  EXPECT_EQ(sut.at(1'010, {152'000}, false).ns, 57'000);
}

}  // namespace
}  // namespace tactus::hal::v4l2
