#include "rt/drop_oldest_ring.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <memory>
#include <random>
#include <thread>
#include <vector>

#include "rt/static_vector.hpp"
#include "tests/rt/interleave_expect.hpp"

namespace tactus::rt {
namespace {

TEST(DropOldestRing, PushWhenFullReturnsOldestToProducer) {
  DropOldestRing<std::uint32_t, 2> sut;
  auto producer = sut.producer();
  EXPECT_EQ(producer.push(1), std::nullopt);
  EXPECT_EQ(producer.push(2), std::nullopt);
  EXPECT_EQ(producer.push(3), 1U);
  auto consumer = sut.consumer();
  EXPECT_EQ(consumer.try_pop(), 2U);
  EXPECT_EQ(consumer.try_pop(), 3U);
  EXPECT_EQ(consumer.try_pop(), std::nullopt);
  EXPECT_EQ(sut.was().pushed, 3U);
  EXPECT_EQ(sut.was().dropped, 1U);
  EXPECT_EQ(sut.was().high_water, 2U);
}

TEST(DropOldestRingDeathTest, SecondOwnerOfAnEndIsABug) {
  DropOldestRing<std::uint32_t, 2> sut;
  auto producer = sut.producer();
  auto consumer = sut.consumer();
  EXPECT_DEATH(static_cast<void>(sut.producer()), "is_taken");
  EXPECT_DEATH(static_cast<void>(sut.consumer()), "is_taken");
}

TEST(DropOldestRing, BehavesAsAQueueThatForgetsItsFront) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  DropOldestRing<std::uint32_t, 4> sut;
  auto producer = sut.producer();
  auto consumer = sut.consumer();
  std::deque<std::uint32_t> model;
  std::uint64_t dropped_count = 0;
  for (std::uint32_t i = 0; i < 100'000; ++i) {
    if (random() % 3 != 0) {
      std::optional<std::uint32_t> expected;
      if (model.size() == 4) {
        expected = model.front();
        model.pop_front();
        ++dropped_count;
      }
      model.push_back(i);
      ASSERT_EQ(producer.push(i), expected);
    } else {
      std::optional<std::uint32_t> expected;
      if (!model.empty()) {
        expected = model.front();
        model.pop_front();
      }
      ASSERT_EQ(consumer.try_pop(), expected);
    }
    ASSERT_EQ(sut.was().dropped, dropped_count);
  }
  EXPECT_GT(dropped_count, 0U);
}

// Ids travel, and with each the right to use plain memory: the consumer reads the frame of what it popped,
// the producer writes again to the frame of what came back.
template <std::size_t kCapacity, std::size_t kPushes, int kPops>
struct DropOldestScenario {
  using Ring = DropOldestRing<std::uint32_t, kCapacity, test::ModelAtomics>;
  Ring sut;
  typename Ring::Producer producer = sut.producer();
  typename Ring::Consumer consumer = sut.consumer();
  std::array<test::Watched, kPushes> frames;
  StaticVector<std::uint32_t, kPushes + 1> dropped, popped;

  void first() {
    for (std::uint32_t i = 0; i < kPushes; ++i) {
      frames[i] = static_cast<int>(100 + i);
      if (const auto oldest = producer.push(i)) {
        frames[*oldest] = -1;
        dropped.push_back(*oldest);
      }
    }
  }
  void second() {
    for (int i = 0; i < kPops; ++i) pop();
  }
  void check() {
    auto& explorer = test::Explorer::current();
    while (pop()) {
    }
    explorer.require(dropped.size() + popped.size() == kPushes, "an item was lost or doubled");
    explorer.require(std::is_sorted(popped.begin(), popped.end()), "popped out of order");
    explorer.require(std::is_sorted(dropped.begin(), dropped.end()), "dropped out of order");
    std::array<int, kPushes> times{};
    for (std::uint32_t i : popped) ++times[i];
    for (std::uint32_t i : dropped) ++times[i];
    for (int n : times) explorer.require(n == 1, "an item was lost or doubled");
    explorer.require(sut.was().dropped == dropped.size(), "dropped miscounted");
  }
  bool pop() {
    const auto item = consumer.try_pop();
    if (!item) return false;
    test::Explorer::current().require(frames[*item].get() == static_cast<int>(100 + *item),
                                      "popped a frame given back");
    popped.push_back(*item);
    return true;
  }
};

TEST(DropOldestRing, HoldsInEveryInterleaving) {
  test::expect_holds_in_every_interleaving<DropOldestScenario<2, 4, 1>>();
  test::expect_holds_in_every_interleaving<DropOldestScenario<2, 3, 2>>();
  // One slot: every push after the first pushes out, and laps a pop that is under way up to three times.
  test::expect_holds_in_every_interleaving<DropOldestScenario<1, 4, 1>>();
}
TEST(DropOldestRing, ExplorationSeesMissingOrders) {
  test::expect_fails_without_memory_orders<DropOldestScenario<2, 3, 2>>();
}

TEST(DropOldestRing, StressDeliversEveryItemToExactlyOneSide) {
  constexpr std::uint32_t kItems = 50'000;
  auto sut = std::make_unique<DropOldestRing<std::uint32_t, 4>>();
  std::vector<std::uint32_t> dropped, popped;
  dropped.reserve(kItems);
  popped.reserve(kItems);
  std::atomic<bool> is_done{false};
  std::thread reader([&] {
    auto consumer = sut->consumer();
    for (;;) {
      const bool was_done = is_done.load();
      const auto item = consumer.try_pop();
      if (item) {
        popped.push_back(*item);
      } else if (was_done) {
        return;
      }
      // Slow down now and then, so that both sides take from the front.
      if (popped.size() % 512 == 0) std::this_thread::yield();
    }
  });
  auto producer = sut->producer();
  for (std::uint32_t i = 0; i < kItems; ++i) {
    if (const auto oldest = producer.push(i)) dropped.push_back(*oldest);
    if (i % 64 == 0) std::this_thread::yield();
  }
  is_done.store(true);
  reader.join();
  EXPECT_TRUE(std::is_sorted(popped.begin(), popped.end()));
  EXPECT_TRUE(std::is_sorted(dropped.begin(), dropped.end()));
  EXPECT_EQ(sut->was().dropped, dropped.size());
  std::vector<std::uint32_t> all(popped);
  all.insert(all.end(), dropped.begin(), dropped.end());
  std::sort(all.begin(), all.end());
  ASSERT_EQ(all.size(), kItems);
  for (std::uint32_t i = 0; i < kItems; ++i) ASSERT_EQ(all[i], i);
}

}  // namespace
}  // namespace tactus::rt
