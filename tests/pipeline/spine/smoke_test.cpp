// The same map and the same poses, to the bit, on every processor and with every instruction set.
#include <gtest/gtest.h>

#include <cstdio>

#include "tests/pipeline/spine/session.hpp"

namespace tactus {
namespace {

// When the pipeline is changed on purpose these change: run the test on x86-64, write down what it printed,
// and let the aarch64 run confirm it.
constexpr std::uint64_t kGeometryHash = 0x3d8afd6847e4cb05ULL, kPosesHash = 0xe90d7509137e046fULL;

TEST(SpineSmoke, MapAndPosesAreTheSameOnEveryProcessor) {
  test::Session sut("synthetic:bedroom?mode=320x240&frames=8&seed=5");
  while (sut.step()) ASSERT_EQ(sut.status, rt::Status::ok) << "frame " << sut.frame();
  const std::uint64_t geometry = sut.spine.map().hash_content().geometry, poses = test::hash_of(sut.poses);
  char constants[128];
  std::snprintf(constants, sizeof constants, "kGeometryHash = 0x%016llxULL, kPosesHash = 0x%016llxULL",
                static_cast<unsigned long long>(geometry), static_cast<unsigned long long>(poses));
  EXPECT_EQ(geometry, kGeometryHash) << "this run: " << constants;
  EXPECT_EQ(poses, kPosesHash) << "this run: " << constants;
  EXPECT_GT(sut.spine.map().blocks_used(), 500U);
}

}  // namespace
}  // namespace tactus
