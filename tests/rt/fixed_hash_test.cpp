#include "rt/fixed_hash.hpp"

#include <gtest/gtest.h>

#include <map>
#include <random>
#include <vector>

#include "tests/rt/aligned_memory.hpp"

namespace tactus::rt {
namespace {

using Table = FixedHash<std::uint32_t, int>;

struct SameHomeHash {
  constexpr std::uint64_t operator()(std::uint32_t) const { return 14; }
};

TEST(FixedHash, UsesExactlyTheBytesItAskedFor) {
  test::AlignedMemory memory(Table::bytes_needed(100));
  Slice slice = memory.slice();
  Table sut;
  sut.bind(slice, 100);
  EXPECT_EQ(slice.bytes_left(), 0U);
}

TEST(FixedHash, InsertWhenFullIsRefusedButFindsWhatIsThere) {
  test::AlignedMemory memory(Table::bytes_needed(3));
  Slice slice = memory.slice();
  Table sut;
  sut.bind(slice, 3);
  for (std::uint32_t key = 0; key < 3; ++key) ASSERT_TRUE(sut.insert(key, 0).is_new);
  EXPECT_EQ(sut.insert(7, 0).value, nullptr);
  const Table::Inserted again = sut.insert(2, 9);
  ASSERT_NE(again.value, nullptr);
  EXPECT_FALSE(again.is_new);
  EXPECT_EQ(*again.value, 0);
  EXPECT_EQ(sut.find(7), nullptr);
}

TEST(FixedHash, ProbeLengthCountsCollisions) {
  using Colliding = FixedHash<std::uint32_t, int, SameHomeHash>;
  test::AlignedMemory memory(Colliding::bytes_needed(8));
  Slice slice = memory.slice();
  Colliding sut;
  sut.bind(slice, 8);
  for (std::uint32_t key = 0; key < 5; ++key) ASSERT_TRUE(sut.insert(key, static_cast<int>(key)).is_new);
  EXPECT_EQ(sut.probe_length_max(), 5U);
  // Removal from the middle of a run that wraps round the end of the table keeps the rest reachable.
  EXPECT_TRUE(sut.erase(1));
  for (std::uint32_t key : {0U, 2U, 3U, 4U}) {
    ASSERT_NE(sut.find(key), nullptr) << key;
    EXPECT_EQ(*sut.find(key), static_cast<int>(key));
  }
}

template <typename Sut>
void compare_with_map(std::uint32_t keys_count, std::size_t count_max, unsigned seed) {
  std::mt19937 random(seed);
  test::AlignedMemory memory(Sut::bytes_needed(count_max));
  Slice slice = memory.slice();
  Sut sut;
  sut.bind(slice, count_max);
  std::map<std::uint32_t, int> model;
  for (int i = 0; i < 20'000; ++i) {
    const std::uint32_t key = static_cast<std::uint32_t>(random()) % keys_count;
    if (random() % 2 == 0) {
      const auto inserted = sut.insert(key, i);
      const bool was_there = model.contains(key);
      const bool has_room = model.size() < count_max;
      ASSERT_EQ(inserted.value != nullptr, was_there || has_room);
      ASSERT_EQ(inserted.is_new, !was_there && has_room);
      if (inserted.is_new) model[key] = i;
    } else {
      ASSERT_EQ(sut.erase(key), model.erase(key) == 1);
    }
    ASSERT_EQ(sut.size(), model.size());
    const std::uint32_t probe = static_cast<std::uint32_t>(random()) % keys_count;
    const int* found = sut.find(probe);
    ASSERT_EQ(found != nullptr, model.contains(probe));
    if (found != nullptr) {
      ASSERT_EQ(*found, model[probe]);
    }
  }
  std::map<std::uint32_t, int> walked;
  sut.for_each([&](std::uint32_t key, int value) { walked[key] = value; });
  EXPECT_EQ(walked, model);
  sut.clear();
  EXPECT_EQ(sut.size(), 0U);
  EXPECT_EQ(sut.find(0), nullptr);
}

TEST(FixedHash, BehavesAsStdMap) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  compare_with_map<Table>(200, 64, seed);
  compare_with_map<FixedHash<std::uint32_t, int, SameHomeHash>>(20, 8, seed);
}

TEST(FixedHash, ProbesStayShortWhenFull) {
  // 4096 consecutive keys at load 1/2: linear probing needs O(log n) slots at worst when the hash mixes well.
  test::AlignedMemory memory(Table::bytes_needed(4096));
  Slice slice = memory.slice();
  Table sut;
  sut.bind(slice, 4096);
  for (std::uint32_t key = 0; key < 4096; ++key) ASSERT_TRUE(sut.insert(key * 64, 0).is_new);
  EXPECT_LE(sut.probe_length_max(), 48U);
}

}  // namespace
}  // namespace tactus::rt
