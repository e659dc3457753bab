#include <gtest/gtest.h>

#include <memory>
#include <optional>

#include "rt/heap_guard.hpp"
#include "tests/pipeline/interact/walking_session.hpp"

namespace tactus::interact {
namespace {

TEST(WalkersHeap, PlacingWalkingAndArrivingInAGameMakesNoHeapCall) {
  if (!rt::heap_guard::is_active()) GTEST_SKIP() << "the sanitizer owns the heap in this build";
  test::BoxRoom room;
  room.enclose(-1, -1, 1, 1);
  Walker ahead;
  ahead.when.at_frame = 5;
  Script script = test::script_of({test::walker_at({-0.5, 0, -0.5}, Vec3d{0.5, 0, -0.5}), ahead});
  Throw ball;
  ball.when.at_frame = 2;
  ball.shape = contact::Shape::sphere(0.05);
  ball.position_world_m = Vec3d{0, 0.3, -0.5};
  script.throws.push_back(ball);
  auto sut = std::make_unique<test::WalkingSession>(room.scene(), std::move(script));
  const std::uint64_t before = rt::heap_guard::thread_calls();
  rt::heap_guard::seal();
  rt::heap_guard::set_fatal(true);
  auto no_heap = std::make_optional<rt::RtScope>();
  sut->run(400);
  no_heap.reset();
  rt::heap_guard::set_fatal(false);
  rt::heap_guard::unseal();
  EXPECT_EQ(rt::heap_guard::thread_calls() - before, 0U);
  EXPECT_EQ(sut->game.walkers().counters().placed, 2U);
  EXPECT_GE(sut->game.walkers().counters().arrivals, 1U);
}

}  // namespace
}  // namespace tactus::interact
