#include "rt/mailbox.hpp"

#include <gtest/gtest.h>

#include <array>
#include <memory>
#include <random>
#include <thread>

#include "rt/static_vector.hpp"
#include "tests/rt/interleave_expect.hpp"

namespace tactus::rt {
namespace {

TEST(Mailbox, LatestOfSeveralIsRead) {
  Mailbox<int> sut;
  auto producer = sut.producer();
  auto consumer = sut.consumer();
  EXPECT_EQ(consumer.latest(), nullptr);
  EXPECT_TRUE(producer.push(1));
  EXPECT_FALSE(producer.push(2));
  ASSERT_NE(consumer.latest(), nullptr);
  EXPECT_EQ(consumer.front(), 2);
  EXPECT_EQ(sut.was().pushed, 2U);
  EXPECT_EQ(sut.was().dropped, 1U);
}

TEST(Mailbox, FrontStaysUntilRefreshed) {
  Mailbox<int> sut;
  auto producer = sut.producer();
  auto consumer = sut.consumer();
  producer.push(1);
  ASSERT_TRUE(consumer.refresh());
  producer.push(2);
  producer.push(3);
  EXPECT_EQ(consumer.front(), 1);
  EXPECT_TRUE(consumer.refresh());
  EXPECT_EQ(consumer.front(), 3);
  EXPECT_FALSE(consumer.refresh());
  EXPECT_EQ(consumer.front(), 3);
}

TEST(Mailbox, SlotsCanBeGivenMemoryAtBoot) {
  std::array<int, 3> memory{};
  Mailbox<int*> sut;
  const auto slots = sut.slots_at_boot();
  for (std::size_t i = 0; i < 3; ++i) slots[i] = &memory[i];
  auto producer = sut.producer();
  auto consumer = sut.consumer();
  for (int i = 1; i < 10; ++i) {
    *producer.back() = i;
    producer.publish();
    ASSERT_EQ(**consumer.latest(), i);
  }
}

TEST(MailboxDeathTest, MisuseIsABug) {
  Mailbox<int> sut;
  auto producer = sut.producer();
  auto consumer = sut.consumer();
  EXPECT_DEATH(static_cast<void>(sut.producer()), "is_taken");
  EXPECT_DEATH(static_cast<void>(sut.consumer()), "is_taken");
  EXPECT_DEATH(static_cast<void>(consumer.front()), "has_value");
  producer.push(1);
  EXPECT_DEATH(static_cast<void>(sut.slots_at_boot()), "pushed");
}

TEST(Mailbox, BehavesAsALatestValue) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  Mailbox<int> sut;
  auto producer = sut.producer();
  auto consumer = sut.consumer();
  int newest = -1, front = -1;
  std::uint64_t dropped_count = 0;
  for (int i = 0; i < 100'000; ++i) {
    if (random() % 2 == 0) {
      const bool was_read = newest == front;
      ASSERT_EQ(producer.push(i), was_read);
      if (!was_read) ++dropped_count;
      newest = i;
    } else {
      ASSERT_EQ(consumer.refresh(), newest != front);
      front = newest;
    }
    ASSERT_EQ(consumer.has_value(), front >= 0);
    if (front >= 0) {
      ASSERT_EQ(consumer.front(), front);
    }
    ASSERT_EQ(sut.was().dropped, dropped_count);
  }
}

struct MailboxScenario {
  using Box = Mailbox<test::Watched, test::ModelAtomics>;
  static constexpr int kPushes = 5;
  Box sut;
  Box::Producer producer = sut.producer();
  Box::Consumer consumer = sut.consumer();
  StaticVector<int, kPushes + 1> taken;
  int overwritten_count = 0;

  void first() {
    for (int i = 1; i <= kPushes; ++i) {
      if (!producer.push(i)) ++overwritten_count;
    }
  }
  void second() {
    for (int i = 0; i < 4; ++i) take();
  }
  void check() {
    auto& explorer = test::Explorer::current();
    take();
    explorer.require(!taken.empty() && taken.back() == kPushes, "the newest value was lost");
    for (std::size_t i = 1; i < taken.size(); ++i)
      explorer.require(taken[i] > taken[i - 1], "an old value came back");
    explorer.require(static_cast<int>(taken.size()) + overwritten_count == kPushes, "overwritten miscounted");
    explorer.require(sut.was().dropped == static_cast<std::uint64_t>(overwritten_count),
                     "dropped miscounted");
  }
  void take() {
    if (consumer.refresh()) taken.push_back(consumer.front().get());
    // Reading again late, after the producer may have gone on: the front must not change.
    if (consumer.has_value()) {
      test::Explorer::current().require(consumer.front().get() == taken.back(),
                                        "the front changed by itself");
    }
  }
};

TEST(Mailbox, HoldsInEveryInterleaving) { test::expect_holds_in_every_interleaving<MailboxScenario>(); }
TEST(Mailbox, ExplorationSeesMissingOrders) { test::expect_fails_without_memory_orders<MailboxScenario>(); }

TEST(Mailbox, StressReadsWholeAndEverNewerValues) {
  struct Big {
    std::array<std::uint64_t, 64> words{};
  };
  constexpr std::uint64_t kPushes = 50'000;
  auto sut = std::make_unique<Mailbox<Big>>();
  std::thread writer([&] {
    auto producer = sut->producer();
    for (std::uint64_t i = 1; i <= kPushes; ++i) {
      producer.back().words.fill(i);
      producer.publish();
      if (i % 32 == 0) std::this_thread::yield();
    }
  });
  auto consumer = sut->consumer();
  std::uint64_t before = 0, wrong_count = 0, taken_count = 0;
  while (before < kPushes) {
    if (!consumer.refresh()) {
      std::this_thread::yield();
      continue;
    }
    ++taken_count;
    const std::uint64_t first = consumer.front().words[0];
    if (first <= before) ++wrong_count;
    for (std::uint64_t word : consumer.front().words) wrong_count += word != first ? 1 : 0;
    before = first;
  }
  writer.join();
  EXPECT_EQ(wrong_count, 0U);
  EXPECT_EQ(taken_count + sut->was().dropped, kPushes);
}

}  // namespace
}  // namespace tactus::rt
