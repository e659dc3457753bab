#include "rt/seqlock.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <random>
#include <thread>

#include "tests/rt/interleave_expect.hpp"

namespace tactus::rt {
namespace {

TEST(Seqlock, ReadsNothingBeforeTheFirstPush) {
  Seqlock<int> sut;
  int value = 7;
  EXPECT_FALSE(sut.read(value));
  EXPECT_EQ(value, 7);
}

TEST(Seqlock, ReadsTheNewestAnyNumberOfTimes) {
  struct Odd {  // not a multiple of the word size
    float x;
    std::uint8_t y;
    char text[5];
  };
  Seqlock<Odd> sut;
  auto producer = sut.producer();
  for (int i = 0; i < 5; ++i) {
    producer.push({static_cast<float>(i), static_cast<std::uint8_t>(i), "abcd"});
    for (int again = 0; again < 2; ++again) {
      Odd value{};
      ASSERT_TRUE(sut.read(value));
      ASSERT_EQ(value.x, static_cast<float>(i));
      ASSERT_EQ(value.y, i);
      ASSERT_STREQ(value.text, "abcd");
    }
  }
  EXPECT_EQ(sut.was().pushed, 5U);
}

TEST(SeqlockDeathTest, SecondProducerIsABug) {
  Seqlock<int> sut;
  auto producer = sut.producer();
  EXPECT_DEATH(static_cast<void>(sut.producer()), "is_taken");
}

TEST(Seqlock, BehavesAsAVariable) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937_64 random(seed);
  struct Three {
    std::uint64_t a, b, c;
  };
  Seqlock<Three> sut;
  auto producer = sut.producer();
  Three model{};
  bool has_value = false;
  for (int i = 0; i < 20'000; ++i) {
    if (random() % 3 == 0) {
      model = {random(), random(), random()};
      has_value = true;
      producer.push(model);
    }
    Three value{};
    ASSERT_EQ(sut.read(value), has_value);
    ASSERT_EQ(value.a, model.a);
    ASSERT_EQ(value.b, model.b);
    ASSERT_EQ(value.c, model.c);
  }
}

// Three pushes come round to the first copy again while a read is under way.
template <int kPushes, int kReads>
struct SeqlockScenario {
  struct Pair {
    std::uint64_t a = 0, b = 0;
  };
  using Lock = Seqlock<Pair, test::ModelAtomics>;
  Lock sut;
  Lock::Producer producer = sut.producer();

  SeqlockScenario() { producer.push({1, 10}); }
  void first() {
    for (std::uint64_t i = 2; i < 2 + kPushes; ++i) producer.push({i, 10 * i});
  }
  void second() {
    std::uint64_t before = 0;
    for (int i = 0; i < kReads; ++i) before = read(before);
  }
  void check() { test::Explorer::current().require(read(0) == 1 + kPushes, "the newest value was lost"); }
  std::uint64_t read(std::uint64_t before) {
    auto& explorer = test::Explorer::current();
    Pair value;
    // Three pushes cannot lap a reader eight times.
    explorer.require(sut.read(value), "gave up");
    explorer.require(value.b == 10 * value.a && value.a != 0, "torn value");
    explorer.require(value.a >= before, "an old value came back");
    return value.a;
  }
};

TEST(Seqlock, HoldsInEveryInterleaving) {
  test::expect_holds_in_every_interleaving<SeqlockScenario<3, 1>>();
  test::expect_holds_in_every_interleaving<SeqlockScenario<2, 2>>();
}
TEST(Seqlock, ExplorationSeesMissingOrders) {
  test::expect_fails_without_memory_orders<SeqlockScenario<3, 1>>();
}

// Two readers: they write nothing, so they cannot disturb each other; that both are served is what is
// checked.
TEST(Seqlock, StressReadsWholeValues) {
  struct Words {
    std::uint64_t w[8];
  };
  constexpr std::uint64_t kPushes = 20'000;
  auto sut = std::make_unique<Seqlock<Words>>();
  auto producer = sut->producer();
  producer.push({});
  std::atomic<std::uint64_t> wrong_count{0}, gave_up_count{0};
  const auto read = [&] {
    std::uint64_t before = 0;
    while (before < kPushes) {
      Words value{};
      if (!sut->read(value)) {
        gave_up_count.fetch_add(1);
        continue;
      }
      for (std::uint64_t word : value.w) wrong_count.fetch_add(word != value.w[0] ? 1 : 0);
      if (value.w[0] < before) wrong_count.fetch_add(1);
      before = value.w[0];
    }
  };
  std::thread first(read), second(read);
  for (std::uint64_t i = 1; i <= kPushes; ++i) {
    Words value{};
    for (std::uint64_t& word : value.w) word = i;
    producer.push(value);
    if (i % 64 == 0) std::this_thread::yield();
  }
  first.join();
  second.join();
  EXPECT_EQ(wrong_count.load(), 0U);
}

}  // namespace
}  // namespace tactus::rt
