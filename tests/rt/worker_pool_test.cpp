#include "rt/worker_pool.hpp"

#include <gtest/gtest.h>

#include <numeric>
#include <random>
#include <thread>
#include <vector>

namespace tactus::rt {
namespace {

class WorkerPoolTest : public testing::TestWithParam<int> {
 protected:
  WorkerPoolTest() { EXPECT_TRUE(sut.start(GetParam(), {.name = "pool"})); }
  WorkerPool sut;
};

TEST_P(WorkerPoolTest, RunsEveryChunkOnceAndReturnsAfterTheLast) {
  EXPECT_EQ(sut.threads_count(), GetParam());
  for (std::uint32_t chunks_count : {0U, 1U, 2U, 3U, 64U, 1000U}) {
    std::vector<int> times(chunks_count, 0);  // plain: run() must hand the results over
    sut.run(chunks_count, [&](std::uint32_t chunk) { ++times[chunk]; });
    for (int n : times) ASSERT_EQ(n, 1);
  }
}

TEST_P(WorkerPoolTest, LanesAreInRangeAndNeverShared) {
  std::array<std::atomic<int>, WorkerPool::kThreadsMax> inside{};
  std::atomic<int> shared_count{0};
  for (int job = 0; job < 200; ++job) {
    sut.run(32, [&](std::uint32_t, std::uint32_t lane) {
      if (inside.at(lane).fetch_add(1) != 0) shared_count.fetch_add(1);
      for (int i = 0; i < 100; ++i) std::atomic_signal_fence(std::memory_order_seq_cst);
      inside.at(lane).fetch_sub(1);
      if (lane >= static_cast<std::uint32_t>(GetParam())) shared_count.fetch_add(1000);
    });
  }
  EXPECT_EQ(shared_count.load(), 0);
}

// Jobs in quick succession and with pauses, so that workers are met spinning and asleep; each job reads what
// the one before wrote.
TEST_P(WorkerPoolTest, StressJobsSeeEachOthersResults) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  std::vector<std::uint64_t> values(97);
  std::iota(values.begin(), values.end(), 0U);
  std::vector<std::uint64_t> model = values, next(values.size());
  for (int job = 0; job < 2000; ++job) {
    const auto step = [&](std::uint32_t i, const std::vector<std::uint64_t>& from) {
      return from[i] * 3 + from[(i + 1) % from.size()];
    };
    sut.run(static_cast<std::uint32_t>(values.size()), [&](std::uint32_t i) { next[i] = step(i, values); });
    values.swap(next);
    std::vector<std::uint64_t> expected(model.size());
    for (std::uint32_t i = 0; i < model.size(); ++i) expected[i] = step(i, model);
    model.swap(expected);
    ASSERT_EQ(values, model) << "job " << job;
    if (random() % 64 == 0) std::this_thread::sleep_for(std::chrono::microseconds(200));
  }
}

INSTANTIATE_TEST_SUITE_P(Threads, WorkerPoolTest, testing::Values(1, 2, 4));

TEST(WorkerPool, WorksAfterStopAndStart) {
  WorkerPool sut;
  for (int round = 0; round < 3; ++round) {
    ASSERT_TRUE(sut.start(2, {.name = "pool"}));
    int sum = 0;
    std::atomic<int> parallel_sum{0};
    sut.run(10, [&](std::uint32_t chunk) { parallel_sum.fetch_add(static_cast<int>(chunk)); });
    EXPECT_EQ(parallel_sum.load(), 45);
    sut.stop();
    sut.run(10, [&](std::uint32_t chunk) { sum += static_cast<int>(chunk); });
    EXPECT_EQ(sum, 45);
  }
}

TEST(WorkerPool, PlainFunctionAndContext) {
  WorkerPool sut;
  int sum = 0;
  sut.run(
      4,
      [](void* context, std::uint32_t chunk, std::uint32_t) {
        *static_cast<int*>(context) += static_cast<int>(chunk);
      },
      &sum);
  EXPECT_EQ(sum, 6);
}

TEST(WorkerPoolDeathTest, RunInsideAChunkIsABug) {
  WorkerPool sut;
  EXPECT_DEATH(sut.run(1, [&](std::uint32_t) { sut.run(1, [](std::uint32_t) {}); }), "is_running");
}

}  // namespace
}  // namespace tactus::rt
