#include "pipeline/map/evict.hpp"

#include <gtest/gtest.h>

#include <set>

#include "tests/pipeline/map/analytic_map.hpp"

namespace tactus::map {
namespace {

using test::OwnedMap;

constexpr std::uint32_t kCapacity = 320;  // 20 blocks a scan part
constexpr std::uint32_t kFrame = 1000;

// A row of blocks along x, block i at x = i, all last seen at `frame`.
void fill_row(Map& map, std::uint32_t count, std::uint32_t frame) {
  for (std::uint32_t i = 0; i < count; ++i)
    map.set_last_seen_frame(map.find_or_allocate(key_of({static_cast<int>(i), 0, 0})), frame);
}

std::uint32_t steps(Evictor& sut, Map& map, std::uint32_t frame, std::uint32_t free_min,
                    std::uint32_t count) {
  std::uint32_t evicted = 0;
  for (std::uint32_t i = 0; i < count; ++i) evicted += sut.step(map, frame, {0, 0, 0}, free_min);
  return evicted;
}

TEST(Evictor, NothingGoesWhileEnoughIsFree) {
  OwnedMap owned({0.01f, 0.04f, kCapacity});
  fill_row(owned.map, kCapacity - 40, 0);
  Evictor sut;
  EXPECT_EQ(steps(sut, owned.map, kFrame, 40, 100), 0U);
}

TEST(Evictor, FreesJustEnoughAndCounts) {
  OwnedMap owned({0.01f, 0.04f, kCapacity});
  fill_row(owned.map, kCapacity, 0);
  Evictor sut;
  steps(sut, owned.map, kFrame, 50, 2 * Evictor::kScanParts);
  EXPECT_EQ(owned.map.blocks_free(), 50U);
  EXPECT_EQ(owned.map.counters().evicted, 50U);
}

TEST(Evictor, TakesTheFarthestOfAScanPart) {
  OwnedMap owned({0.01f, 0.04f, kCapacity});
  fill_row(owned.map, kCapacity, 0);
  Evictor sut;
  // The first part holds blocks 0 .. 19; six are wanted.
  EXPECT_EQ(sut.step(owned.map, kFrame, {0, 0, 0}, 6), 6U);
  for (int x = 0; x < 20; ++x) EXPECT_EQ(owned.map.find(key_of({x, 0, 0})) == kNoBlock, x >= 14) << x;
}

TEST(Evictor, SparesWhatWasSeenLatelyUntilNothingElseIsLeft) {
  OwnedMap owned({0.01f, 0.04f, kCapacity});
  Map& map = owned.map;
  fill_row(map, kCapacity, kFrame - 100);
  for (int x = 0; x < 30; ++x) map.set_last_seen_frame(map.find(key_of({x, 0, 0})), kFrame - 301);
  Evictor sut;
  // The first round over the pool knows an age of 300 frames only.
  EXPECT_EQ(steps(sut, map, kFrame, 100, Evictor::kScanParts - 1), 30U);
  for (int x = 0; x < static_cast<int>(kCapacity); ++x)
    EXPECT_EQ(map.find(key_of({x, 0, 0})) == kNoBlock, x < 30) << x;
  // Then 150, then 75: what is 100 frames old goes in the third.
  steps(sut, map, kFrame, 100, 3 * Evictor::kScanParts);
  EXPECT_EQ(map.blocks_free(), 100U);
}

TEST(Evictor, NeverTakesWhatThisOrTheLastFrameSaw) {
  OwnedMap owned({0.01f, 0.04f, kCapacity});
  fill_row(owned.map, kCapacity, kFrame);
  for (int x = 0; x < 100; ++x) owned.map.set_last_seen_frame(owned.map.find(key_of({x, 0, 0})), kFrame - 1);
  Evictor sut;
  EXPECT_EQ(steps(sut, owned.map, kFrame, kCapacity, 20 * Evictor::kScanParts), 0U);
  EXPECT_EQ(owned.map.blocks_used(), kCapacity);
}

TEST(Evictor, WorkOfAFrameIsBounded) {
  constexpr std::uint32_t kLarge = 16 * 600;
  OwnedMap owned({0.01f, 0.04f, kLarge});
  for (std::uint32_t i = 0; i < kLarge; ++i)
    owned.map.set_last_seen_frame(
        owned.map.find_or_allocate(key_of({static_cast<int>(i % 1000), static_cast<int>(i / 1000), 0})), 0);
  Evictor sut;
  EXPECT_EQ(sut.step(owned.map, kFrame, {0, 0, 0}, kLarge), Evictor::kEvictionsMax);
}

TEST(Evictor, SameBlocksGoInEveryRun) {
  const auto run = [] {
    OwnedMap owned({0.01f, 0.04f, kCapacity});
    fill_row(owned.map, kCapacity, 0);
    Evictor sut;
    for (std::uint32_t frame = 400; frame < 420; ++frame) sut.step(owned.map, frame, {1.0, 0.5, 0.0}, 77);
    return owned.map.hash_content().geometry;
  };
  EXPECT_EQ(run(), run());
}

}  // namespace
}  // namespace tactus::map
