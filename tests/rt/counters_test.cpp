#include "rt/counters.hpp"

#include <gtest/gtest.h>

namespace tactus::rt {
namespace {

TEST(StatusCounters, CountsEachStatusApart) {
  StatusCounters sut;
  for (int status = 0; status < kStatusCount; ++status) {
    for (int n = 0; n <= status; ++n) sut.count(static_cast<Status>(status));
  }
  for (int status = 0; status < kStatusCount; ++status) {
    EXPECT_EQ(sut.was(static_cast<Status>(status)), static_cast<std::uint64_t>(status) + 1)
        << name(static_cast<Status>(status));
  }
  EXPECT_EQ(sut.was_total(), static_cast<std::uint64_t>(kStatusCount * (kStatusCount + 1) / 2));
}

TEST(StatusCountersDeathTest, UnknownStatusIsABug) {
  StatusCounters sut;
  EXPECT_DEATH(sut.count(static_cast<Status>(kStatusCount)), "assertion failed");
}

}  // namespace
}  // namespace tactus::rt
