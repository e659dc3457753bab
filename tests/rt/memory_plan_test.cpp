#include "rt/memory_plan.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace tactus::rt {
namespace {

MemoryRow depth_frames() {
  return {.name = "depth frames",
          .holders = {{"driver", 2}, {"integrate", 1}, {"recorder", 1}},
          .bytes_each = 1000,
          .alignment = 4096,
          .owner = "hal",
          .why = "640x480 z16"};
}

MemoryPlan two_rows_and_a_guest() {
  MemoryPlan plan;
  plan.add({.name = "poses", .holders = {{"track", 10}}, .bytes_each = 10, .owner = "track"});
  plan.add(depth_frames());
  plan.add({.name = "egl",
            .holders = {{"driver", 1}},
            .bytes_each = 1 << 20,
            .owner = "render",
            .is_outside_arena = true});
  return plan;
}

TEST(MemoryRow, CountIsTheSumOfItsHolders) {
  constexpr MemoryRow kRow{.name = "r", .holders = {{"a", 2}, {"b", 3}}, .bytes_each = 10};
  static_assert(kRow.count() == 5 && kRow.bytes() == 64, "usable in constant expressions");
  EXPECT_EQ(depth_frames().count(), 4U);
  EXPECT_EQ(depth_frames().bytes(), round_up(4000, 64));
}

TEST(MemoryPlan, TotalsCountPaddingAndGuestsApart) {
  const MemoryPlan sut = two_rows_and_a_guest();
  EXPECT_EQ(sut.total_bytes(), 128U + 4032U + (1U << 20));
  EXPECT_EQ(sut.arena_bytes(), 4096U + 4032U);
  ASSERT_NE(sut.find("poses"), nullptr);
  EXPECT_EQ(sut.find("poses")->count(), 10U);
  EXPECT_EQ(sut.find("nothing"), nullptr);
}

TEST(MemoryPlan, CarvesWhatItSummedUp) {
  MemoryPlan sut = two_rows_and_a_guest();
  auto arena = Arena::reserve(sut.arena_bytes());
  ASSERT_TRUE(arena);
  sut.carve(*arena);
  EXPECT_EQ(arena->bytes_high_water(), sut.arena_bytes());
  EXPECT_EQ(sut.take("depth frames").bytes_left(), 4032U);
}

TEST(MemoryPlan, PrintsRowsHoldersAndHighWater) {
  MemoryPlan sut = two_rows_and_a_guest();
  sut.set_high_water("depth frames", 3);
  std::vector<char> text(sut.print({}) + 1);
  EXPECT_EQ(sut.print(text), text.size() - 1);
  const std::string table(text.data());
  EXPECT_NE(table.find("driver 2 + integrate 1 + recorder 1; 640x480 z16"), std::string::npos) << table;
  EXPECT_NE(table.find("outside the arena"), std::string::npos) << table;
  EXPECT_NE(table.find("         3  hal"), std::string::npos) << table;
}

TEST(MemoryPlan, PrintIntoTooLittleIsCutAndTerminated) {
  const MemoryPlan sut = two_rows_and_a_guest();
  char text[20];
  EXPECT_GT(sut.print(text), sizeof text);
  EXPECT_EQ(std::string(text).size(), sizeof text - 1);
}

TEST(MemoryPlanDeathTest, MisuseIsABug) {
  MemoryPlan sut = two_rows_and_a_guest();
  EXPECT_DEATH(sut.add(depth_frames()), "assertion failed");
  EXPECT_DEATH(sut.take("poses"), "is_carved");
  auto arena = Arena::reserve(sut.arena_bytes());
  ASSERT_TRUE(arena);
  sut.carve(*arena);
  sut.take("poses");
  EXPECT_DEATH(sut.take("poses"), "was_taken");
  EXPECT_DEATH(sut.take("egl"), "outside_arena");
  EXPECT_DEATH(sut.carve(*arena), "is_carved");
}

}  // namespace
}  // namespace tactus::rt
