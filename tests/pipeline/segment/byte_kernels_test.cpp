#include "pipeline/segment/byte_kernels.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "pipeline/segment/exponential.hpp"

namespace tactus::segment {
namespace {

TEST(Exponential, StaysWithinTwoParts10To7OfLongDouble) {
  long double worst = 0;
  for (double x = -86.9; x < 88; x += 0.00137) {
    const auto arg = static_cast<float>(x);
    const long double exact = std::exp(static_cast<long double>(arg));
    worst = std::max(worst, std::abs(static_cast<long double>(exponential(arg)) / exact - 1));
  }
  EXPECT_LT(worst, 2e-7L);
}

TEST(Exponential, EndsAreDefined) {
  EXPECT_EQ(exponential(0.0F), 1.0F);
  EXPECT_EQ(exponential(-1e30F), 0.0F);
  EXPECT_EQ(exponential(std::numeric_limits<float>::quiet_NaN()), 0.0F);
  EXPECT_TRUE(std::isfinite(exponential(1e30F)));
}

TEST(FixedMultiplier, IsWithinOneOfTheRealProduct) {
  std::mt19937 random(20261122);
  for (int i = 0; i < 20000; ++i) {
    const double real = std::exp(std::uniform_real_distribution<double>(-14, 3)(random));
    const auto x = static_cast<std::int32_t>(random() % 2000001) - 1000000;
    const double exact = real * x;
    EXPECT_NEAR(multiply(x, fixed_multiplier(real)), exact, 1.0) << real << " * " << x;
  }
}

TEST(FixedMultiplier, OneIsExactAndTinyIsZero) {
  for (const std::int32_t x : {-1000000, -1, 0, 1, 77, 1000000}) {
    EXPECT_EQ(multiply(x, fixed_multiplier(1.0)), x);
    EXPECT_EQ(multiply(x, fixed_multiplier(1e-12)), 0);
  }
}

TEST(RequantizeTable, ShiftOfZeroPointIsExact) {
  const ByteFormat from{ElementType::uint8, 1 / 127.5F, 127}, to{ElementType::int8, 1 / 127.5F, -1};
  const ByteTable sut = requantize_table(from, to, -128, 127);
  for (int byte = 0; byte < 256; ++byte)
    EXPECT_EQ(static_cast<std::int8_t>(sut[static_cast<std::size_t>(byte)]), byte - 128);
}

TEST(LogisticTable, RisesAndMeetsItsMiddle) {
  const ByteTable sut = logistic_table({ElementType::int8, 0.05F, 0}, {ElementType::int8, 1.0F / 256, -128});
  EXPECT_EQ(static_cast<std::int8_t>(sut[0]), 0);  // logistic(0) = 128 / 256
  int before = -129;
  for (int q = -128; q < 128; ++q) {
    const int value = static_cast<std::int8_t>(sut[static_cast<std::uint8_t>(q)]);
    EXPECT_GE(value, before);
    before = value;
  }
  EXPECT_EQ(before, 127);
}

}  // namespace
}  // namespace tactus::segment
