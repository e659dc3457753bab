#include "rt/spsc_ring.hpp"

#include <gtest/gtest.h>

#include <deque>
#include <memory>
#include <random>
#include <thread>

#include "rt/static_vector.hpp"
#include "tests/rt/interleave_expect.hpp"

namespace tactus::rt {
namespace {

TEST(SpscRing, PushWhenFullTellsTheProducer) {
  SpscRing<int, 2> sut;
  auto producer = sut.producer();
  EXPECT_TRUE(producer.try_push(1));
  EXPECT_TRUE(producer.try_push(2));
  EXPECT_FALSE(producer.try_push(3));
  const EdgeCounts counts = sut.was();
  EXPECT_EQ(counts.pushed, 2U);
  EXPECT_EQ(counts.dropped, 1U);
  EXPECT_EQ(counts.high_water, 2U);
}

TEST(SpscRing, PopWhenEmptyChangesNothing) {
  SpscRing<int, 2> sut;
  auto consumer = sut.consumer();
  int item = 7;
  EXPECT_FALSE(consumer.try_pop(item));
  EXPECT_EQ(item, 7);
}

TEST(SpscRing, EndCanBeTakenAgainAfterItWasGivenBack) {
  SpscRing<int, 2> sut;
  { EXPECT_TRUE(sut.producer().try_push(1)); }
  auto producer = sut.producer();
  EXPECT_TRUE(producer.try_push(2));
  EXPECT_FALSE(producer.try_push(3));
}

TEST(SpscRingDeathTest, SecondOwnerOfAnEndIsABug) {
  SpscRing<int, 2> sut;
  auto producer = sut.producer();
  auto consumer = sut.consumer();
  EXPECT_DEATH(static_cast<void>(sut.producer()), "is_taken");
  EXPECT_DEATH(static_cast<void>(sut.consumer()), "is_taken");
}

TEST(SpscRing, BehavesAsABoundedQueue) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  SpscRing<int, 8> sut;
  auto producer = sut.producer();
  auto consumer = sut.consumer();
  std::deque<int> model;
  EdgeCounts counts;
  for (int i = 0; i < 100'000; ++i) {
    // Runs of one kind, so that full and empty are both met.
    const bool pushes = (random() % 16 < 8) != ((i / 50) % 2 == 0 && random() % 4 != 0);
    if (pushes) {
      const bool fits = model.size() < 8;
      ASSERT_EQ(producer.try_push(i), fits);
      if (fits) {
        model.push_back(i);
        ++counts.pushed;
        counts.high_water = std::max<std::uint64_t>(counts.high_water, model.size());
      } else {
        ++counts.dropped;
      }
    } else {
      int item = -1;
      ASSERT_EQ(consumer.try_pop(item), !model.empty());
      if (!model.empty()) {
        ASSERT_EQ(item, model.front());
        model.pop_front();
      }
    }
    ASSERT_EQ(sut.was().pushed, counts.pushed);
    ASSERT_EQ(sut.was().dropped, counts.dropped);
    ASSERT_EQ(sut.was().high_water, counts.high_water);
  }
  EXPECT_GT(counts.dropped, 0U) << "full was never met";
}

// Three pushes into two slots against three pops: empty, full and re-used slots all occur.
struct SpscScenario {
  SpscRing<test::Watched, 2, test::ModelAtomics> sut;
  SpscRing<test::Watched, 2, test::ModelAtomics>::Producer producer = sut.producer();
  SpscRing<test::Watched, 2, test::ModelAtomics>::Consumer consumer = sut.consumer();
  StaticVector<int, 3> accepted, popped;

  void first() {
    for (int i = 1; i <= 3; ++i) {
      if (producer.try_push(i)) accepted.push_back(i);
    }
  }
  void second() { pop(3); }
  void check() {
    pop(3);
    test::Explorer::current().require(popped.size() == accepted.size(), "an item was lost or doubled");
    for (std::size_t i = 0; i < popped.size() && i < accepted.size(); ++i) {
      test::Explorer::current().require(popped[i] == accepted[i], "wrong item or order");
    }
    test::Explorer::current().require(sut.was().pushed == accepted.size(), "pushed miscounted");
    test::Explorer::current().require(sut.was().dropped == 3 - accepted.size(), "dropped miscounted");
    test::Explorer::current().require(sut.was().high_water <= 2, "more waiting than fits");
  }
  void pop(int attempts) {
    test::Watched item;
    for (int i = 0; i < attempts; ++i) {
      if (consumer.try_pop(item)) popped.push_back(item.get());
    }
  }
};

TEST(SpscRing, HoldsInEveryInterleaving) { test::expect_holds_in_every_interleaving<SpscScenario>(); }
TEST(SpscRing, ExplorationSeesMissingOrders) { test::expect_fails_without_memory_orders<SpscScenario>(); }

TEST(SpscRing, StressLosesNothing) {
  struct Item {
    std::uint64_t number = 0;
    std::uint64_t inverse = 0;
  };
  constexpr std::uint64_t kItems = 200'000;
  auto sut = std::make_unique<SpscRing<Item, 64>>();
  std::thread writer([&] {
    auto producer = sut->producer();
    for (std::uint64_t i = 0; i < kItems;) {
      if (producer.try_push({i, ~i})) {
        ++i;
      } else {
        std::this_thread::yield();
      }
    }
  });
  auto consumer = sut->consumer();
  std::uint64_t wrong_count = 0;
  for (std::uint64_t expected = 0; expected < kItems;) {
    Item item;
    if (!consumer.try_pop(item)) {
      std::this_thread::yield();
      continue;
    }
    if (item.number != expected || item.inverse != ~expected) ++wrong_count;
    ++expected;
  }
  writer.join();
  EXPECT_EQ(wrong_count, 0U);
  EXPECT_EQ(sut->was().pushed, kItems);
  EXPECT_LE(sut->was().high_water, 64U);
}

}  // namespace
}  // namespace tactus::rt
