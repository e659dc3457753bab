// Tracking lost for a while, and found again.
#include <gtest/gtest.h>

#include <cstdio>

#include "tests/pipeline/spine/session.hpp"

namespace tactus {
namespace {

using test::Session;

void expect_recovery(const std::string& source, int frames_to_recover, double tolerance_m) {
  Session sut(source);
  constexpr int kBlankFirst = 100, kBlankCount = 6;
  map::Map::Hash held;
  int recovered_after = -1;
  while (sut.step()) {
    const int i = sut.frame();
    if (i < kBlankFirst) {
      ASSERT_EQ(sut.status, rt::Status::ok) << "frame " << i;
    }
    if (i == kBlankFirst - 1) held = sut.spine.map().hash_content();
    if (i >= kBlankFirst && i < kBlankFirst + kBlankCount) {
      EXPECT_NE(sut.status, rt::Status::ok) << "frame " << i;
      EXPECT_EQ(sut.spine.map().hash_content().geometry, held.geometry) << "a lost frame changed the map";
      EXPECT_EQ(sut.poses.back().translation, sut.poses[kBlankFirst - 1].translation)
          << "the last good pose is kept";
    }
    if (i < kBlankFirst + kBlankCount) continue;
    if (recovered_after < 0 && sut.status == rt::Status::ok) {
      recovered_after = i - kBlankFirst - kBlankCount + 1;
      EXPECT_TRUE(sut.spine.result().relocalized);
    }
    if (recovered_after < 0) {
      EXPECT_EQ(sut.spine.map().hash_content().geometry, held.geometry) << "a lost frame changed the map";
    }
    if (i >= kBlankFirst + kBlankCount + frames_to_recover - 1) {
      EXPECT_EQ(sut.status, rt::Status::ok) << "frame " << i;
      EXPECT_LT(sut.error_m(), tolerance_m) << "frame " << i;
    }
  }
  std::printf("recovered after %d frames, error at the end %.3f mm\n", recovered_after, sut.error_m() * 1e3);
  EXPECT_GE(recovered_after, 1);
  EXPECT_LE(recovered_after, frames_to_recover);
}

// Six blank frames, then 13 cm and 6.5 degrees off.
TEST(SpineRecovery, RecoversAtVgaWithinFiveFramesAndTenMillimetres) {
  expect_recovery("synthetic:bedroom?frames=130&blank=100:6&jump=1", 5, 0.010);
}

TEST(SpineRecovery, RecoversAtAQuarterOfThePixelsAsWell) {
  expect_recovery("synthetic:bedroom?mode=320x240&frames=130&blank=100:6&jump=1", 5, 0.010);
}

/// 30 frames that all come, then `missing_count` are lost before every eighth.
void expect_followed(const std::string& source, int missing_count, double tolerance_m) {
  Session sut(source);
  for (int i = 0; sut.step(i >= 30 && i % 8 == 0 ? missing_count : 0); ++i) {
    ASSERT_EQ(sut.status, rt::Status::ok) << "frame " << sut.frame();
    EXPECT_FALSE(sut.spine.result().relocalized) << "frame " << sut.frame();
    EXPECT_LT(sut.error_m(), tolerance_m) << "frame " << sut.frame();
  }
}

// Once round the room's loop in 2 s; a calm hand takes 10.
TEST(SpineRecovery, OneMissingFrameOfAFastHandIsNotNoticed) {
  expect_followed("synthetic:bedroom?mode=320x240&frames=60", 1, 0.006);
}

TEST(SpineRecovery, SixMissingFramesOfACalmHandAreNotNoticed) {
  expect_followed("synthetic:bedroom?mode=320x240&frames=300", 6, 0.010);
}

}  // namespace
}  // namespace tactus
