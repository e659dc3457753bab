#include "pipeline/capture/pairing.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace tactus {
namespace {

hal::FrameHeader at_ms(double ms) {
  hal::FrameHeader header;
  header.time = {static_cast<std::int64_t>(ms * 1e6)};
  return header;
}

TEST(Pairing, OneClock_WindowIsHalfAnIntervalBeforeToTwentyMillisecondsAfter) {
  Pairing sut;
  sut.configure(30, false);
  const hal::FrameHeader depth = at_ms(100);
  EXPECT_EQ(sut.match(depth, at_ms(100 - 16.7)), Match::early);
  EXPECT_EQ(sut.match(depth, at_ms(100 - 16.6)), Match::partner);
  EXPECT_EQ(sut.match(depth, at_ms(100)), Match::partner);
  EXPECT_EQ(sut.match(depth, at_ms(120)), Match::partner);
  EXPECT_EQ(sut.match(depth, at_ms(120.001)), Match::late);
}

TEST(Pairing, SlowCameras_WindowIsTheStatedSkew) {
  Pairing sut;
  sut.configure(5, false);
  EXPECT_EQ(sut.match(at_ms(100), at_ms(79.9)), Match::early);
  EXPECT_EQ(sut.match(at_ms(100), at_ms(80)), Match::partner);
}

TEST(Pairing, Pairs_AreInTheHistogramBySignedWholeMilliseconds) {
  Pairing sut;
  sut.configure(30, false);
  sut.count_pair(at_ms(100), at_ms(100.4));
  sut.count_pair(at_ms(100), at_ms(99.6));
  sut.count_pair(at_ms(100), at_ms(103.2));
  sut.count_pair(at_ms(100), at_ms(91.8));
  sut.count_pair(at_ms(100), at_ms(120));
  EXPECT_EQ(sut.paired(), 5U);
  EXPECT_EQ(sut.skew_ms_counts()[20], 2U);
  EXPECT_EQ(sut.skew_ms_counts()[23], 1U);
  EXPECT_EQ(sut.skew_ms_counts()[12], 1U);
  EXPECT_EQ(sut.skew_ms_counts()[40], 1U);
  EXPECT_EQ(sut.distance().max().ns, 20'000'000);
}

/// A device whose clock starts anywhere and runs fast by `ppm`; delays are `delay_ms` and more.
struct Device {
  std::int64_t start_ns;
  double ppm, delay_ms;

  hal::FrameHeader frame(double host_s, std::mt19937& random) const {
    hal::FrameHeader header;
    header.time = {start_ns + static_cast<std::int64_t>(host_s * (1 + ppm * 1e-6) * 1e9)};
    const double jitter_ms = std::exponential_distribution<double>(0.5)(random);
    header.arrived = {static_cast<std::int64_t>(host_s * 1e9 + (delay_ms + jitter_ms) * 1e6) + 77'000'000'000};
    return header;
  }
};

TEST(ClockFit, DriftingClockWithJitter_IsFoundWithinTwoMillionths) {
  for (const double ppm : {-80.0, -5.0, 0.0, 30.0, 100.0}) {
    std::mt19937 random(42);
    SCOPED_TRACE(testing::Message() << ppm << " ppm, seed 42");
    const Device device{123'456'789'000, ppm, 5};
    ClockFit sut;
    for (int i = 0; i < 30 * 60; ++i) {
      const hal::FrameHeader header = device.frame(i / 30.0, random);
      sut.add(header.time, header.arrived);
    }
    ASSERT_TRUE(sut.drift_ppm());
    EXPECT_NEAR(*sut.drift_ppm(), ppm, 2);
    const std::int64_t true_ns = 77'000'000'000 + 60'000'000'000 + 5'000'000;
    const rt::SensorTime at_minute{123'456'789'000 + static_cast<std::int64_t>(60e9 * (1 + ppm * 1e-6))};
    EXPECT_NEAR(static_cast<double>(sut.host_of(at_minute).ns), static_cast<double>(true_ns), 3e5) << "0.3 ms";
    EXPECT_NEAR(static_cast<double>(sut.sensor_of(sut.host_of(at_minute)).ns), static_cast<double>(at_minute.ns), 1e3);
  }
}

TEST(ClockFit, DeviceThatFallsBehind_HasNoDrift) {
  ClockFit sut;
  for (std::int64_t i = 0; i < 300; ++i) sut.add({i * 33'333'333}, {i * 34'000'000});
  EXPECT_FALSE(sut.drift_ppm()) << "2 % is no clock";
  ClockFit young;
  for (std::int64_t i = 0; i < 60; ++i) young.add({i * 33'333'333}, {i * 33'333'333});
  EXPECT_FALSE(young.drift_ppm()) << "two seconds say nothing";
}

TEST(Pairing, TwoClocksThatDriftApart_PairsAreTheTrueOnes) {
  std::mt19937 random(7);
  SCOPED_TRACE("seed 7");
  const Device depth_device{5'000'000'000, 60, 4}, color_device{900'000'000'000, -40, 4};
  Pairing sut;
  sut.configure(30, true);
  constexpr double kColorLater = 0.006;  // seconds: colour is exposed so much after its depth
  int wrong_count = 0;
  double worst_ms = 0;
  for (int i = 0; i < 30 * 120; ++i) {
    const double host_s = i / 30.0;
    const hal::FrameHeader depth = depth_device.frame(host_s, random);
    const hal::FrameHeader color = color_device.frame(host_s + kColorLater, random);
    sut.saw_depth(depth);
    sut.saw_color(color);
    if (i < 60) continue;  // two seconds to learn
    if (sut.match(depth, color) != Match::partner) ++wrong_count;
    sut.count_pair(depth, color);
    worst_ms = std::max(worst_ms, std::abs(sut.distance().max().milliseconds() - kColorLater * 1e3));
  }
  EXPECT_EQ(wrong_count, 0);
  EXPECT_LT(worst_ms, 1.5) << "off the true skew";
  EXPECT_NEAR(sut.depth_clock().drift_ppm().value_or(0), 60, 3);
  EXPECT_NEAR(sut.color_clock().drift_ppm().value_or(0), -40, 3);
}

}  // namespace
}  // namespace tactus
