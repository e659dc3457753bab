// What noise does to the pose.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>

#include "tests/pipeline/spine/session.hpp"

namespace tactus {
namespace {

using test::Session;

// In the true first pose's frame: the noise of the first frame is in the map, and in every pose after it.
struct Errors {
  double rmse_m = 0, worst_m = 0;
  int lost_count = 0;
};

Errors run(const char* source) {
  Session sut(source);
  Errors errors;
  double sum2 = 0;
  while (sut.step()) {
    sum2 += sut.error_m() * sut.error_m();
    errors.worst_m = std::max(errors.worst_m, sut.error_m());
    errors.lost_count += sut.status != rt::Status::ok;
  }
  errors.rmse_m = std::sqrt(sum2 / static_cast<double>(sut.poses.size()));
  std::printf("%s: RMSE %.3f mm, worst %.3f mm\n", source, errors.rmse_m * 1e3, errors.worst_m * 1e3);
  return errors;
}

TEST(SpineAccuracy, StandingStillInNoiseDriftsLessThanATenthOfAMillimetre) {
  const Errors sut = run("synthetic:bedroom?frames=60&trajectory=still");
  EXPECT_EQ(sut.lost_count, 0);
  EXPECT_LT(sut.worst_m, 0.0001);
}

TEST(SpineAccuracy, WalkingInNoiseStaysWithinAMillimetre) {
  for (const char* source : {"synthetic:bedroom?frames=60", "synthetic:office?frames=60"}) {
    const Errors sut = run(source);
    EXPECT_EQ(sut.lost_count, 0);
    EXPECT_LT(sut.rmse_m, 0.001);
  }
}

TEST(SpineAccuracy, QvgaStandingStillInNoiseHoldsAsWell) {
  const Errors sut = run("synthetic:bedroom?mode=320x240&frames=60&trajectory=still");
  EXPECT_EQ(sut.lost_count, 0);
  EXPECT_LT(sut.worst_m, 0.0005);
}

}  // namespace
}  // namespace tactus
