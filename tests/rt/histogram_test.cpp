#include "rt/histogram.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace tactus::rt {
namespace {

TEST(Histogram, EmptyAnswersZero) {
  const Histogram sut;
  EXPECT_EQ(sut.p50(), 0_ns);
  EXPECT_EQ(sut.max(), 0_ns);
  EXPECT_EQ(sut.count(), 0U);
}

TEST(Histogram, SmallValuesAreExact) {
  Histogram sut;
  for (std::int64_t ns = 1; ns <= 60; ++ns) sut.record({ns});
  EXPECT_EQ(sut.p50(), 30_ns);
  EXPECT_EQ(sut.percentile(0), 1_ns);
  EXPECT_EQ(sut.percentile(1), 60_ns);
}

TEST(Histogram, OneSampleIsAllPercentiles) {
  Histogram sut;
  sut.record(3'333'333_ns);
  EXPECT_EQ(sut.p50(), 3'333'333_ns);
  EXPECT_EQ(sut.p99(), 3'333'333_ns);
  EXPECT_EQ(sut.min(), sut.max());
}

TEST(Histogram, ValuesOutOfRangeAreKeptAtTheEnds) {
  Histogram sut;
  sut.record({-5});
  sut.record(500_s);
  EXPECT_EQ(sut.percentile(0), 0_ns);
  EXPECT_EQ(sut.max(), 500_s);
  EXPECT_EQ(sut.percentile(1), 500_s);
}

// Oracle: the sorted samples. Log-uniform from 1 ns to 60 s meets every octave.
TEST(Histogram, PercentilesAreWithinTwoPercentOfTheSortedSamples) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> exponent(0, std::log(60e9));
  for (std::size_t count : {1U, 2U, 99U, 100U, 101U, 10'000U}) {
    Histogram first, second;
    std::vector<std::int64_t> samples;
    for (std::size_t i = 0; i < count; ++i) {
      samples.push_back(static_cast<std::int64_t>(std::exp(exponent(random))));
      (i % 3 == 0 ? first : second).record({samples.back()});
    }
    std::sort(samples.begin(), samples.end());
    second.merge(first);
    const Histogram& sut = second;
    ASSERT_EQ(sut.count(), count);
    ASSERT_EQ(sut.max().ns, samples.back());
    ASSERT_EQ(sut.min().ns, samples.front());
    for (double share : {0.0, 0.01, 0.25, 0.5, 0.9, 0.99, 0.999, 1.0}) {
      const double rank = std::max(1.0, std::ceil(share * static_cast<double>(count)));
      const std::int64_t exact = samples[static_cast<std::size_t>(rank) - 1];
      const std::int64_t answer = sut.percentile(share).ns;
      ASSERT_GE(answer, exact) << share << " of " << count;
      ASSERT_LE(static_cast<double>(answer - exact), 0.02 * static_cast<double>(exact))
          << share << " of " << count;
    }
  }
}

}  // namespace
}  // namespace tactus::rt
