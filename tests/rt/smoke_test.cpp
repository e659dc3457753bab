// The runtime in one small program, for machines that are emulated: threads, atomics, memory, the interposed
// malloc.
#include <gtest/gtest.h>

#include <memory>
#include <thread>

#include "rt/arena.hpp"
#include "rt/clock.hpp"
#include "rt/drop_oldest_ring.hpp"
#include "rt/frame_pool.hpp"
#include "rt/heap_guard.hpp"
#include "rt/mailbox.hpp"
#include "rt/seqlock.hpp"
#include "rt/spsc_ring.hpp"
#include "rt/worker_pool.hpp"

namespace tactus::rt {
namespace {

TEST(RtSmoke, ClockRuns) {
  const Clock clock = Clock::monotonic();
  const HostTime before = clock.now();
  clock.sleep_until(before + 1_ms);
  EXPECT_GE(clock.now() - before, 1_ms);
}

TEST(RtSmoke, FramesTravelThroughPoolRingAndMailbox) {
  struct Frame {
    int number = 0;
  };
  struct Pose {
    double x, y;
  };
  using Pool = FramePool<Frame>;
  auto arena = Arena::reserve(Pool::bytes_needed(6));
  ASSERT_TRUE(arena);
  Slice slice = arena->carve(Pool::bytes_needed(6));
  Pool pool;
  pool.bind(slice, 6);
  arena->seal();
  DropOldestRing<FrameId, 4> frames;
  SpscRing<int, 64> events;
  Mailbox<int> latest;
  Seqlock<Pose> pose;
  constexpr int kFrames = 2000;
  std::thread reader([&] {
    auto consumer = frames.consumer();
    auto event_producer = events.producer();
    auto latest_producer = latest.producer();
    auto pose_producer = pose.producer();
    for (int number = 0; number < kFrames;) {
      const auto id = consumer.try_pop();
      if (!id) {
        std::this_thread::yield();
        continue;
      }
      number = pool.adopt(*id)->number;
      static_cast<void>(event_producer.try_push(number));
      latest_producer.push(number);
      pose_producer.push({static_cast<double>(number), 2.0 * number});
    }
  });
  auto producer = frames.producer();
  auto event_consumer = events.consumer();
  auto latest_consumer = latest.consumer();
  int event_before = 0, latest_before = 0, wrong_count = 0;
  for (int number = 1; number <= kFrames; ++number) {
    auto lease = pool.try_lease();
    ASSERT_TRUE(lease);
    (*lease)->number = number;
    if (const auto oldest = producer.push(std::move(*lease).share().into_id())) pool.drop(*oldest);
    int event = 0;
    while (event_consumer.try_pop(event)) {
      wrong_count += event <= event_before ? 1 : 0;
      event_before = event;
    }
    if (const int* value = latest_consumer.latest()) {
      wrong_count += *value < latest_before ? 1 : 0;
      latest_before = *value;
    }
    Pose seen{};
    if (pose.read(seen)) wrong_count += seen.y != 2 * seen.x ? 1 : 0;
    std::this_thread::yield();
  }
  reader.join();
  EXPECT_EQ(wrong_count, 0);
  EXPECT_EQ(*latest_consumer.latest(), kFrames);
  EXPECT_EQ(pool.was_free_count(), 6U);
}

TEST(RtSmoke, WorkersShareALoop) {
  WorkerPool pool;
  ASSERT_TRUE(pool.start(2, {.name = "smoke"}));
  for (int job = 0; job < 50; ++job) {
    std::array<std::uint32_t, 33> squares{};
    pool.run(33, [&](std::uint32_t i) { squares[i] = i * i; });
    for (std::uint32_t i = 0; i < 33; ++i) ASSERT_EQ(squares[i], i * i);
  }
}

TEST(RtSmoke, HeapGuardCounts) {
  if (!heap_guard::is_active()) GTEST_SKIP() << "a sanitizer's malloc is in place";
  heap_guard::seal();
  {
    const RtScope scope;
    const auto seen = std::make_unique<int>(1);
    asm volatile("" : : "r"(seen.get()) : "memory");
  }
  heap_guard::unseal();
  EXPECT_EQ(heap_guard::thread_calls(), 1U);
}

}  // namespace
}  // namespace tactus::rt
