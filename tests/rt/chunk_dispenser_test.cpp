#include "rt/chunk_dispenser.hpp"

#include <gtest/gtest.h>

#include <array>

#include "tests/rt/interleave_expect.hpp"

namespace tactus::rt {
namespace {

TEST(ChunkDispenser, HandsOutEachChunkOnceAndSaysWhoWasLast) {
  ChunkDispenser<> sut;
  EXPECT_FALSE(sut.try_claim());
  for (int job = 0; job < 3; ++job) {
    sut.publish(2);
    const auto first = sut.try_claim();
    const auto second = sut.try_claim();
    ASSERT_TRUE(first && second);
    EXPECT_EQ(first->chunk_index, 0U);
    EXPECT_EQ(second->chunk_index, 1U);
    EXPECT_FALSE(sut.try_claim());
    EXPECT_FALSE(sut.finish(*second));
    EXPECT_TRUE(sut.finish(*first));
  }
}

TEST(ChunkDispenserDeathTest, FinishingMoreThanWasClaimedIsABug) {
  ChunkDispenser<> sut;
  sut.publish(1);
  const auto claim = sut.try_claim();
  EXPECT_TRUE(sut.finish(*claim));
  EXPECT_DEATH(static_cast<void>(sut.finish(*claim)), "chunks_count");
}

// A caller publishes two jobs one after the other (the second only if nobody else still works on the first)
// while a worker that knows nothing of jobs keeps claiming. The job's fields and the results are plain
// memory.
struct TwoJobsScenario {
  static constexpr std::uint32_t kChunks = 2;
  ChunkDispenser<test::ModelAtomics> sut;
  test::Watched factor;
  std::array<test::Watched, kChunks> results;
  // What the pool's ended_count_ does: the last one says so to the caller.
  test::ModelAtomic<int> ended_count;
  int jobs_published = 0;

  void work(int claims_max) {
    for (int i = 0; i < claims_max; ++i) {
      const auto claim = sut.try_claim();
      if (!claim) continue;
      auto& result = results[claim->chunk_index];
      result = result.get() + factor.get();
      if (sut.finish(*claim)) ended_count.fetch_add(1, std::memory_order_release);
    }
  }
  bool ended() { return ended_count.load(std::memory_order_acquire) == jobs_published; }
  void publish(int value) {
    factor = value;
    ++jobs_published;
    sut.publish(kChunks);
  }
  void first() {
    publish(1);
    work(kChunks);
    if (!ended()) return;
    check_results(1);
    publish(10);
    work(1);
  }
  void second() { work(3); }
  void check() {
    work(kChunks);
    test::Explorer::current().require(ended(), "a job did not end");
    check_results(jobs_published == 1 ? 1 : 11);
  }
  void check_results(int expected) {
    for (const test::Watched& result : results) {
      test::Explorer::current().require(result.get() == expected,
                                        "a chunk was done twice, never, or for the wrong job");
    }
  }
};

TEST(ChunkDispenser, HoldsInEveryInterleaving) {
  test::expect_holds_in_every_interleaving<TwoJobsScenario>();
}
TEST(ChunkDispenser, ExplorationSeesMissingOrders) {
  test::expect_fails_without_memory_orders<TwoJobsScenario>();
}

}  // namespace
}  // namespace tactus::rt
