// Counts every call of the malloc family in this program while the world steps.
#include <gtest/gtest.h>

#include <atomic>
#include <cstddef>

#include "tests/pipeline/contact/analytic_field.hpp"

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define TACTUS_HEAP_IS_SANITIZED 1
#else
#define TACTUS_HEAP_IS_SANITIZED 0
namespace {
std::atomic<long> heap_calls{0};
}
extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void __libc_free(void*);
void* malloc(std::size_t bytes) {
  heap_calls.fetch_add(1, std::memory_order_relaxed);
  return __libc_malloc(bytes);
}
void* calloc(std::size_t count, std::size_t bytes) {
  heap_calls.fetch_add(1, std::memory_order_relaxed);
  return __libc_calloc(count, bytes);
}
void* realloc(void* block, std::size_t bytes) {
  heap_calls.fetch_add(1, std::memory_order_relaxed);
  return __libc_realloc(block, bytes);
}
void free(void* block) {
  if (block != nullptr) heap_calls.fetch_add(1, std::memory_order_relaxed);
  __libc_free(block);
}
}
#endif

namespace tactus::contact {
namespace {

TEST(WorldHeap, FiftyBodiesStepSpawnAndLeaveWithoutAHeapCall) {
#if TACTUS_HEAP_IS_SANITIZED
  GTEST_SKIP() << "the sanitizer owns the heap in this build";
#else
  test::AnalyticField scene([](const Vec3d& p) { return p.y; });
  auto sut = std::make_unique<test::BoundWorld>(scene.field());
  const long before = heap_calls.load();
  std::vector<BodyId> ids;
  ids.reserve(64);
  const long reserve_calls = heap_calls.load() - before;
  ASSERT_EQ(reserve_calls, 1) << "the counter does not count";

  const long start = heap_calls.load();
  for (int round = 0; round < 3; ++round) {
    ids.clear();
    for (int i = 0; i < 50; ++i) {
      BodySpec spec;
      spec.shape = i % 2 == 0 ? Shape::sphere(0.06) : Shape::box({0.05, 0.06, 0.07});
      spec.position_world_m = {0.15 * (i % 7), 0.1 + 0.15 * (i / 7), 0.02 * (i % 3)};
      ids.push_back(sut->spawn(spec));
    }
    for (int i = 0; i < 400; ++i) sut->run_step();
    for (const BodyId id : ids) ASSERT_EQ(sut->world.remove(id), rt::Status::ok);
  }
  const long calls = heap_calls.load() - start;
  EXPECT_EQ(calls, 0);
  EXPECT_GT(sut->world.counters().contacts, 1000U);
  EXPECT_EQ(sut->world.counters().steps, 1200U);
#endif
}

TEST(WorldHeap, PoolNeverGrowsAfterBindAndRefusesNothing) {
  test::AnalyticField scene([](const Vec3d& p) { return p.y; });
  auto sut = std::make_unique<test::BoundWorld>(scene.field());
  const std::size_t carved = sut->world.memory_use().carved_bytes;
  for (int i = 0; i < 64; ++i) {
    BodySpec spec;
    spec.shape = Shape::box({0.05, 0.05, 0.05});
    spec.position_world_m = {0.11 * (i % 4), 0.06 + 0.11 * (i / 16), 0.11 * (i / 4 % 4)};
    sut->spawn(spec);
  }
  sut->run(3);
  std::printf("planned %zu B, carved %zu B, in use at most %zu B, contacts at most %zu\n",
              sut->world.memory_use().capacity_bytes, sut->world.memory_use().carved_bytes,
              sut->world.memory_use().in_use_bytes_max, sut->world.counters().contacts_max);
  EXPECT_EQ(sut->world.memory_use().refused, 0U);
  EXPECT_LE(sut->world.memory_use().carved_bytes, carved + carved / 20);
  EXPECT_EQ(sut->world.counters().steps_failed, 0U);
}

}  // namespace
}  // namespace tactus::contact
