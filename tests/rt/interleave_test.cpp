// The explorer itself: it counts what can be counted by hand, and it sees the classic mistakes.
#include "tests/rt/interleave.hpp"

#include <gtest/gtest.h>

#include <set>
#include <utility>

namespace tactus::test {
namespace {

class ExplorerTest : public testing::Test {
 protected:
  void SetUp() override {
    if (!kCanExplore) GTEST_SKIP() << "explored in builds without ThreadSanitizer";
  }
};

std::set<std::pair<int, int>> seen;

// Store buffering: each thread stores its flag and reads the other's. Both may read 0 when nothing is
// sequentially consistent; no other pair is impossible either.
struct StoreBuffering {
  ModelAtomic<int> x, y;
  int a = -1, b = -1;
  void first() {
    x.store(1, std::memory_order_release);
    a = y.load(std::memory_order_acquire);
  }
  void second() {
    y.store(1, std::memory_order_release);
    b = x.load(std::memory_order_acquire);
  }
  void check() { seen.insert({a, b}); }
};

TEST_F(ExplorerTest, FindsAllOutcomesOfStoreBuffering) {
  seen.clear();
  const auto outcome = Explorer().explore<StoreBuffering>();
  EXPECT_TRUE(outcome.is_complete);
  EXPECT_EQ(seen, (std::set<std::pair<int, int>>{{0, 0}, {0, 1}, {1, 0}, {1, 1}}));
}

// Message passing: seeing the flag implies seeing the data, if and only if released and acquired.
struct MessagePassing {
  ModelAtomic<int> data, flag;
  int f = -1, d = -1;
  void first() {
    data.store(1, std::memory_order_relaxed);
    flag.store(1, std::memory_order_release);
  }
  void second() {
    f = flag.load(std::memory_order_acquire);
    d = data.load(std::memory_order_relaxed);
  }
  void check() { seen.insert({f, d}); }
};

TEST_F(ExplorerTest, MessagePassingNeedsReleaseAndAcquire) {
  seen.clear();
  EXPECT_TRUE(Explorer().explore<MessagePassing>().is_complete);
  EXPECT_EQ(seen, (std::set<std::pair<int, int>>{{0, 0}, {0, 1}, {1, 1}}));
  seen.clear();
  EXPECT_TRUE(Explorer(true).explore<MessagePassing>().is_complete);
  EXPECT_EQ(seen.count({1, 0}), 1U);
}

// Two increments per thread of one variable: all accesses depend on each other, so every interleaving is run:
// C(4,2) = 6.
struct Increments {
  ModelAtomic<int> count;
  void first() { twice(); }
  void second() { twice(); }
  void twice() {
    count.fetch_add(1, std::memory_order_relaxed);
    count.fetch_add(1, std::memory_order_relaxed);
  }
  void check() { Explorer::current().require(count.load(std::memory_order_relaxed) == 4, "lost increment"); }
};

TEST_F(ExplorerTest, RunsEveryInterleavingOfDependentAccesses) {
  const auto outcome = Explorer().explore<Increments>();
  EXPECT_EQ(outcome.schedules_count, 6U);
  EXPECT_TRUE(outcome.is_complete);
  EXPECT_EQ(outcome.failure, "");
}

// Accesses of different variables commute: one schedule stands for all 20.
struct Strangers {
  ModelAtomic<int> x, y;
  void first() {
    for (int i = 0; i < 3; ++i) x.fetch_add(1, std::memory_order_relaxed);
  }
  void second() {
    for (int i = 0; i < 3; ++i) y.fetch_add(1, std::memory_order_relaxed);
  }
  void check() {}
};

TEST_F(ExplorerTest, RunsOneOfEquivalentInterleavings) {
  const auto outcome = Explorer().explore<Strangers>();
  EXPECT_EQ(outcome.schedules_count, 1U);
  EXPECT_TRUE(outcome.is_complete);
}

// Load, add, store loses an increment in some interleaving only.
struct LostIncrement {
  ModelAtomic<int> count;
  void first() { count.store(count.load(std::memory_order_acquire) + 1, std::memory_order_release); }
  void second() { first(); }
  void check() { Explorer::current().require(count.load(std::memory_order_relaxed) == 2, "lost increment"); }
};

TEST_F(ExplorerTest, FindsTheLostIncrementAndSaysWhere) {
  const auto outcome = Explorer().explore<LostIncrement>();
  EXPECT_EQ(outcome.failure.find("lost increment; schedule: "), 0U) << outcome.failure;
}

struct UnprotectedPayload {
  Watched payload;
  ModelAtomic<int> unrelated;
  void first() {
    payload = 1;
    unrelated.store(1, std::memory_order_release);
  }
  void second() {
    unrelated.store(2, std::memory_order_release);
    static_cast<void>(payload.get());
  }
  void check() {}
};

TEST_F(ExplorerTest, SeesADataRace) {
  EXPECT_NE(Explorer().explore<UnprotectedPayload>().failure.find("data race"), std::string::npos);
}

struct EndlessWait {
  ModelAtomic<int> never;
  void first() {
    while (never.load(std::memory_order_relaxed) == 0) {
    }
  }
  void second() {}
  void check() {}
};

TEST_F(ExplorerTest, CallsAnEndlessLoopByItsName) {
  EXPECT_EQ(Explorer().explore<EndlessWait>().failure.find("endless loop"), 0U);
}

struct Asserting {
  ModelAtomic<int> x;
  void first() { TACTUS_ASSERT(x.load(std::memory_order_relaxed) == 0); }
  void second() { x.store(1, std::memory_order_relaxed); }
  void check() {}
};

TEST_F(ExplorerTest, ReportsAssertionsOfTheTypeUnderTest) {
  EXPECT_EQ(Explorer().explore<Asserting>().failure.find("assertion failed"), 0U);
}

}  // namespace
}  // namespace tactus::test
