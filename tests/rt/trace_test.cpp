#include "rt/trace.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "tests/rt/aligned_memory.hpp"

namespace tactus::rt {
namespace {

std::vector<std::int64_t> values_of(const TraceRing& ring) {
  std::vector<std::int64_t> values;
  ring.for_each([&](const TraceRecord& record) { values.push_back(record.value); });
  return values;
}

TEST(TraceRing, KeepsTheNewestInOrderAndCountsTheRest) {
  test::AlignedMemory memory(TraceRing::bytes_needed(3));
  Slice slice = memory.slice();
  TraceRing sut;
  sut.bind(slice, 3);
  EXPECT_EQ(values_of(sut), (std::vector<std::int64_t>{}));
  sut.instant("a", {1}, 1);
  sut.instant("a", {2}, 2);
  EXPECT_EQ(values_of(sut), (std::vector<std::int64_t>{1, 2}));
  sut.instant("a", {3}, 3);
  EXPECT_EQ(sut.overwritten_count(), 0U);
  sut.instant("a", {4}, 4);
  sut.instant("a", {5}, 5);
  EXPECT_EQ(values_of(sut), (std::vector<std::int64_t>{3, 4, 5}));
  EXPECT_EQ(sut.overwritten_count(), 2U);
  EXPECT_EQ(sut.recorded_count(), 5U);
}

TEST(TraceRing, RecordsWhatItWasTold) {
  test::AlignedMemory memory(TraceRing::bytes_needed(2));
  Slice slice = memory.slice();
  TraceRing sut;
  sut.bind(slice, 2);
  sut.span("integrate", {10}, 5_us, 7);
  sut.counter("blocks", {20}, 99);
  std::vector<TraceRecord> records;
  sut.for_each([&](const TraceRecord& record) { records.push_back(record); });
  ASSERT_EQ(records.size(), 2U);
  EXPECT_STREQ(records[0].name, "integrate");
  EXPECT_EQ(records[0].start, HostTime{10});
  EXPECT_EQ(records[0].duration, 5_us);
  EXPECT_EQ(records[0].kind, TraceKind::span);
  EXPECT_EQ(records[1].value, 99);
  EXPECT_EQ(records[1].kind, TraceKind::counter);
}

TEST(TraceRing, UnboundSwallowsEverything) {
  TraceRing sut;
  sut.instant("a", {1});
  EXPECT_EQ(sut.size(), 0U);
  EXPECT_EQ(values_of(sut), (std::vector<std::int64_t>{}));
}

}  // namespace
}  // namespace tactus::rt
