#include "rt/frame_pool.hpp"

#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <random>
#include <thread>
#include <vector>

#include "rt/drop_oldest_ring.hpp"
#include "tests/rt/aligned_memory.hpp"
#include "tests/rt/interleave_expect.hpp"

namespace tactus::rt {
namespace {

struct Frame {
  int number = 0;
  std::array<int, 30> pixels{};
};
using Pool = FramePool<Frame>;

class FramePoolTest : public testing::Test {
 protected:
  FramePoolTest() {
    Slice slice = memory_.slice();
    sut.bind(slice, 3);
    EXPECT_EQ(slice.bytes_left(), 0U);
  }
  Pool sut;

 private:
  test::AlignedMemory memory_{Pool::bytes_needed(3)};
};
using FramePoolDeathTest = FramePoolTest;

TEST_F(FramePoolTest, LastRefReturnsTheFrame) {
  auto lease = sut.try_lease();
  ASSERT_TRUE(lease);
  (*lease)->number = 5;
  Pool::Ref first = std::move(*lease).share();
  EXPECT_EQ(first->number, 5);
  {
    const Pool::Ref second = first;
    first = {};
    EXPECT_EQ(sut.was_free_count(), 2U);
    EXPECT_EQ(second->number, 5);
  }
  EXPECT_EQ(sut.was_free_count(), 3U);
}

TEST_F(FramePoolTest, UnsharedLeaseReturnsTheFrame) {
  { const auto lease = sut.try_lease(); }
  EXPECT_EQ(sut.was_free_count(), 3U);
}

TEST_F(FramePoolTest, ExhaustionIsAnAnswerAndCounted) {
  std::vector<Pool::Lease> held;
  for (int i = 0; i < 3; ++i) held.push_back(*sut.try_lease());
  EXPECT_FALSE(sut.try_lease());
  EXPECT_FALSE(sut.try_lease());
  EXPECT_EQ(sut.was().pushed, 3U);
  EXPECT_EQ(sut.was().dropped, 2U);
  EXPECT_EQ(sut.was().high_water, 3U);
  held.pop_back();
  EXPECT_TRUE(sut.try_lease());
}

TEST_F(FramePoolTest, IdsOfOneSlotDifferFromFillingToFilling) {
  const FrameId first = sut.try_lease()->id();
  const FrameId second = sut.try_lease()->id();
  EXPECT_EQ(first.slot(), second.slot());
  EXPECT_NE(first, second);
}

TEST_F(FramePoolTest, IdThatTravelsKeepsTheFrameAlive) {
  auto lease = sut.try_lease();
  (*lease)->number = 9;
  const FrameId id = std::move(*lease).share().into_id();
  EXPECT_EQ(sut.was_free_count(), 2U);
  EXPECT_EQ(sut.adopt(id)->number, 9);
  EXPECT_EQ(sut.was_free_count(), 3U);
}

TEST_F(FramePoolDeathTest, StaleIdIsABug) {
  FrameId stale;
  {
    const Pool::Ref ref = std::move(*sut.try_lease()).share();
    stale = ref.id();
  }
  EXPECT_DEATH(static_cast<void>(sut.ref(stale)), "holders >= 1");
  const Pool::Ref next = std::move(*sut.try_lease()).share();
  EXPECT_DEATH(static_cast<void>(sut.ref(stale)), "generation");
  EXPECT_DEATH(static_cast<void>(sut.adopt(stale)), "generation");
}

TEST_F(FramePoolDeathTest, ReadingALeasedFrameIsABug) {
  const auto lease = sut.try_lease();
  EXPECT_DEATH(static_cast<void>(sut.ref(lease->id())), "holders");
}

TEST_F(FramePoolDeathTest, UsingAMovedFromHandleIsABug) {
  auto lease = sut.try_lease();
  const Pool::Ref ref = std::move(*lease).share();
  EXPECT_DEATH(static_cast<void>((*lease)->number), "pool_");
  EXPECT_DEATH(static_cast<void>(Pool::Ref()->number), "pool_");
}

TEST_F(FramePoolDeathTest, SixtyThirdReaderIsABug) {
  const Pool::Ref ref = std::move(*sut.try_lease()).share();
  std::vector<Pool::Ref> readers(61, ref);
  EXPECT_DEATH(readers.push_back(Pool::Ref(ref)), "kReadersMax");
}

TEST_F(FramePoolTest, BehavesAsASharedPointerPerFrame) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  struct Held {
    Pool::Ref ref;
    int number;
  };
  std::vector<Held> refs;
  std::vector<std::pair<FrameId, int>> ids;
  std::map<int, int> holders;  // number of frame -> how many hold it
  const auto release = [&](int number) {
    if (--holders[number] == 0) holders.erase(number);
  };
  for (int i = 0; i < 50'000; ++i) {
    switch (random() % 5) {
      case 0: {
        auto lease = sut.try_lease();
        ASSERT_EQ(lease.has_value(), holders.size() < 3);
        if (lease) {
          (*lease)->number = i;
          refs.push_back({std::move(*lease).share(), i});
          holders[i] = 1;
        }
        break;
      }
      case 1:
        // 62 holders are the pool's limit, and beyond it is a bug: ids that travel count as well.
        if (!refs.empty() && refs.size() + ids.size() < 40) {
          const Held& held = refs[random() % refs.size()];
          ++holders[held.number];
          refs.push_back(random() % 2 == 0 ? held : Held{sut.ref(held.ref.id()), held.number});
        }
        break;
      case 2:
        if (!refs.empty()) {
          std::swap(refs[random() % refs.size()], refs.back());
          ids.emplace_back(std::move(refs.back().ref).into_id(), refs.back().number);
          refs.pop_back();
        }
        break;
      case 3:
        if (!ids.empty()) {
          refs.push_back({sut.adopt(ids.back().first), ids.back().second});
          ids.pop_back();
        }
        break;
      default:
        if (!refs.empty()) {
          std::swap(refs[random() % refs.size()], refs.back());
          release(refs.back().number);
          refs.pop_back();
        }
    }
    ASSERT_EQ(sut.was_free_count(), 3 - holders.size());
    for (const Held& held : refs) ASSERT_EQ(held.ref->number, held.number);
  }
}

using ModelPool = FramePool<test::Watched, test::ModelAtomics>;

struct PoolScenario {
  explicit PoolScenario(std::size_t frames_count) {
    Slice slice({memory, sizeof memory});
    sut.bind(slice, frames_count);
  }
  alignas(kCacheLineBytes) std::byte memory[ModelPool::bytes_needed(3)];
  ModelPool sut;

  void read(const ModelPool::Ref& ref, int expected) {
    test::Explorer::current().require(ref->get() == expected, "the frame changed under a reader");
  }
  bool fill(int value) {
    auto lease = sut.try_lease();
    if (!lease) return false;
    **lease = value;
    const ModelPool::Ref ref = std::move(*lease).share();
    read(ref, value);
    return true;
  }
};

// Both threads hold the only frame, let go, and try to fill it again: only one of them is the last.
struct LastReaderScenario : PoolScenario {
  FrameId ids[2];
  LastReaderScenario() : PoolScenario(1) {
    auto lease = sut.try_lease();
    **lease = 7;
    ModelPool::Ref ref = std::move(*lease).share();
    ids[0] = ModelPool::Ref(ref).into_id();
    ids[1] = std::move(ref).into_id();
  }
  void first() { use(0); }
  void second() { use(1); }
  void use(int thread) {
    read(sut.adopt(ids[thread]), 7);
    fill(10 + thread);
  }
  void check() {
    test::Explorer::current().require(sut.was_free_count() == 1, "the frame did not come back");
    test::Explorer::current().require(fill(99), "the frame cannot be leased again");
  }
};

// One counts more readers by id and by copy while the other lets go.
struct CountingScenario : PoolScenario {
  FrameId ids[2];
  CountingScenario() : PoolScenario(1) {
    auto lease = sut.try_lease();
    **lease = 7;
    ModelPool::Ref ref = std::move(*lease).share();
    ids[0] = ModelPool::Ref(ref).into_id();
    ids[1] = std::move(ref).into_id();
  }
  void first() {
    const ModelPool::Ref held = sut.adopt(ids[0]);
    const ModelPool::Ref by_id = sut.ref(ids[0]);
    const ModelPool::Ref by_copy = by_id;
    read(by_copy, 7);
  }
  void second() {
    { read(sut.adopt(ids[1]), 7); }
    fill(8);
  }
  void check() {
    test::Explorer::current().require(sut.was_free_count() == 1, "the frame did not come back");
  }
};

// Two fillers and two frames, then one frame short: no frame has two writers.
struct TwoWritersScenario : PoolScenario {
  TwoWritersScenario() : PoolScenario(2) {}
  bool got[2] = {};
  void first() {
    got[0] = fill(1);
    fill(2);
  }
  void second() {
    auto lease = sut.try_lease();
    got[1] = lease.has_value();
    if (lease) **lease = 3;
  }
  void check() {
    test::Explorer::current().require(got[0] && got[1], "refused although a frame was free");
    test::Explorer::current().require(sut.was_free_count() == 2, "a frame did not come back");
  }
};

// The whole way of a frame: leased, filled, shared, sent as an id through a ring that drops the oldest, read,
// returned.
struct SensorScenario : PoolScenario {
  using Ring = DropOldestRing<FrameId, 1, test::ModelAtomics>;
  Ring ring;
  Ring::Producer producer = ring.producer();
  Ring::Consumer consumer = ring.consumer();
  SensorScenario() : PoolScenario(3) {}
  void first() {
    for (int i = 1; i <= 3; ++i) {
      auto lease = sut.try_lease();
      test::Explorer::current().require(lease.has_value(),
                                        "3 frames = filling 1 + waiting 1 + reading 1, yet none free");
      if (!lease) return;
      **lease = i;
      if (const auto oldest = producer.push(std::move(*lease).share().into_id())) sut.drop(*oldest);
    }
  }
  void second() {
    pop();
    pop();
  }
  void pop() {
    if (const auto id = consumer.try_pop()) {
      const ModelPool::Ref ref = sut.adopt(*id);
      test::Explorer::current().require(ref->get() >= 1 && ref->get() <= 3, "not the frame that was sent");
    }
  }
  void check() {
    pop();
    test::Explorer::current().require(sut.was_free_count() == 3, "a frame did not come back");
  }
};

TEST(FramePool, LastReaderHoldsInEveryInterleaving) {
  test::expect_holds_in_every_interleaving<LastReaderScenario>();
}
TEST(FramePool, CountingHoldsInEveryInterleaving) {
  test::expect_holds_in_every_interleaving<CountingScenario>();
}
TEST(FramePool, TwoWritersHoldInEveryInterleaving) {
  test::expect_holds_in_every_interleaving<TwoWritersScenario>();
}
TEST(FramePool, SensorWayHoldsInEveryInterleaving) {
  test::expect_holds_in_every_interleaving<SensorScenario>();
}
TEST(FramePool, ExplorationSeesMissingOrders) {
  test::expect_fails_without_memory_orders<LastReaderScenario>();
  test::expect_fails_without_memory_orders<SensorScenario>();
}

TEST(FramePool, StressKeepsFramesWholeWhileRead) {
  constexpr int kFrames = 30'000;
  // driver 1 + waiting 4 + reader 1 + reader's copy in the second thread's ring 4 + second thread 1
  test::AlignedMemory memory(Pool::bytes_needed(11));
  Slice slice = memory.slice();
  auto sut = std::make_unique<Pool>();
  sut->bind(slice, 11);
  DropOldestRing<FrameId, 4> to_first, to_second;
  std::atomic<int> stage_done{0};
  std::atomic<int> wrong_count{0};
  const auto check = [&](const Pool::Ref& ref) {
    for (int pixel : ref->pixels) wrong_count.fetch_add(pixel != ref->number ? 1 : 0);
  };
  std::thread second([&] {
    auto consumer = to_second.consumer();
    for (;;) {
      const bool was_done = stage_done.load() == 2;
      if (const auto id = consumer.try_pop()) {
        check(sut->adopt(*id));
      } else if (was_done) {
        return;
      } else {
        std::this_thread::yield();
      }
    }
  });
  std::thread first([&] {
    auto consumer = to_first.consumer();
    auto producer = to_second.producer();
    for (;;) {
      const bool was_done = stage_done.load() == 1;
      if (const auto id = consumer.try_pop()) {
        const Pool::Ref ref = sut->adopt(*id);
        if (const auto oldest = producer.push(sut->ref(ref.id()).into_id())) check(sut->adopt(*oldest));
        check(ref);
      } else if (was_done) {
        stage_done.store(2);
        return;
      } else {
        std::this_thread::yield();
      }
    }
  });
  {
    auto producer = to_first.producer();
    for (int i = 1; i <= kFrames; ++i) {
      auto lease = sut->try_lease();
      if (!lease) {
        wrong_count.fetch_add(1'000'000);  // the sum of holders above was wrong
        break;
      }
      (*lease)->number = i;
      (*lease)->pixels.fill(i);
      if (const auto oldest = producer.push(std::move(*lease).share().into_id())) check(sut->adopt(*oldest));
      if (i % 8 == 0) std::this_thread::yield();
    }
    stage_done.store(1);
  }
  first.join();
  second.join();
  EXPECT_EQ(wrong_count.load(), 0);
  EXPECT_EQ(sut->was_free_count(), 11U);
  EXPECT_EQ(sut->was().pushed, static_cast<std::uint64_t>(kFrames));
}

}  // namespace
}  // namespace tactus::rt
