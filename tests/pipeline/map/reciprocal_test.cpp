#include "pipeline/map/reciprocal.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace tactus::map {
namespace {

TEST(Reciprocal, IsWithinTwoInAMillionOfTheScaledQuotient) {
  double worst = 0;
  // Every 127th float from 1e-30 to 1e37: all mantissas' beginnings, all exponents that occur.
  for (std::uint32_t bits = std::bit_cast<std::uint32_t>(1e-30f); bits < std::bit_cast<std::uint32_t>(1e37f);
       bits += 127) {
    const auto x = std::bit_cast<float>(bits);
    worst = std::fmax(worst, std::fabs(static_cast<double>(scaled_reciprocal(x)) * static_cast<double>(x) / static_cast<double>(kReciprocalScale) - 1.0));
  }
  EXPECT_LT(worst, 1.8e-6);
}

}  // namespace
}  // namespace tactus::map
