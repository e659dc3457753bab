#include <gtest/gtest.h>

#include <memory>
#include <optional>

#include "rt/heap_guard.hpp"
#include "tests/pipeline/interact/agent_room.hpp"

namespace tactus::interact {
namespace {

TEST(AgentHeap, WanderingPlanningAndReplacingMakesNoHeapCall) {
  if (!rt::heap_guard::is_active()) GTEST_SKIP() << "the sanitizer owns the heap in this build";
  test::BoxRoom room;
  room.enclose(-1, -1, 1, 1);
  room.solids.push_back({{-0.3, 0, -0.3}, {0.2, 0.3, 0.1}});
  auto sut = std::make_unique<test::BoundAgent>(room.scene());
  const std::uint64_t before = rt::heap_guard::thread_calls();
  rt::heap_guard::seal();
  rt::heap_guard::set_fatal(true);
  auto no_heap = std::make_optional<rt::RtScope>();
  for (int round = 0; round < 2; ++round) {
    sut->agent.place({-0.6, 0.3, -0.6});
    sut->agent.wander(7);
    for (int i = 0; i < 600; ++i) TACTUS_ASSERT(sut->step() == rt::Status::ok);
    sut->agent.set_goal({5, 0, 0});
    for (int i = 0; i < 200; ++i) TACTUS_ASSERT(sut->step() == rt::Status::ok);
  }
  no_heap.reset();
  rt::heap_guard::set_fatal(false);
  rt::heap_guard::unseal();
  EXPECT_EQ(rt::heap_guard::thread_calls() - before, 0U);
  EXPECT_GE(sut->agent.counters().arrivals, 2U);
}

}  // namespace
}  // namespace tactus::interact
