#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <vector>

#include "rt/heap_guard.hpp"
#include "tests/pipeline/contact/analytic_field.hpp"
#include "tests/pipeline/contact/test_shapes.hpp"

namespace tactus::contact {
namespace {

TEST(WorldHeap, FiftyBodiesStepSpawnAndLeaveWithoutAHeapCall) {
  if (!rt::heap_guard::is_active()) GTEST_SKIP() << "the sanitizer owns the heap in this build";
  test::AnalyticField scene([](const Vec3d& p) { return p.y; });
  auto sut = std::make_unique<test::BoundWorld>(scene.field());
  std::vector<BodyId> ids;
  ids.reserve(64);
  // A heap in which every pair of shapes meets.
  std::vector<Shape> shapes;
  for (const test::Lying& lying : test::lying_shapes()) shapes.push_back(lying.shape);
  shapes.push_back(Shape::convex(test::pebble_hull()));

  const std::uint64_t before = rt::heap_guard::thread_calls();
  rt::heap_guard::seal();
  rt::heap_guard::set_fatal(true);
  auto no_heap = std::make_optional<rt::RtScope>();
  for (int round = 0; round < 3; ++round) {
    ids.clear();
    for (int i = 0; i < 50; ++i) {
      BodySpec spec;
      spec.shape = shapes[static_cast<std::size_t>(i + round) % shapes.size()];
      spec.position_world_m = {0.06 * (i % 7), 0.1 + 0.12 * (i / 7), 0.02 * (i % 3)};
      spec.is_debris = i % 9 == 0;
      ids.push_back(sut->spawn(spec));
    }
    for (int i = 0; i < 400; ++i) sut->run_step();
    for (const BodyId id : ids) TACTUS_ASSERT(sut->world.remove(id) == rt::Status::ok);
  }
  no_heap.reset();
  rt::heap_guard::set_fatal(false);
  rt::heap_guard::unseal();
  EXPECT_EQ(rt::heap_guard::thread_calls() - before, 0U);
  EXPECT_GT(sut->world.counters().contacts, 1000U);
  EXPECT_EQ(sut->world.counters().steps, 1200U);
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
