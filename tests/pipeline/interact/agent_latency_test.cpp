// What a step of the agent costs on the map of the built-in bedroom; run alone on a quiet machine. Prints,
// and asserts only that the work was done.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <vector>

#include "hal/synthetic/scene.hpp"
#include "pipeline/contact/map_field.hpp"
#include "tests/pipeline/contact/filled_map.hpp"
#include "tests/pipeline/interact/walking_session.hpp"

namespace tactus::interact {
namespace {

double thread_time_us() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) * 1e6 + static_cast<double>(t.tv_nsec) * 1e-3;
}

TEST(AgentLatency, WanderingInTheBedroom) {
  const auto scene = hal::synthetic::make_scene(hal::synthetic::SceneId::bedroom);
  const Vec3d low = scene.room_min_m(), high = scene.room_max_m();
  const test::FilledMap map([&](const Vec3d& p) { return scene.distance(p); },
                            [&](const Vec3d& p) { return static_cast<MaterialId>(scene.material(p)); },
                            {low.x, -0.05, low.z}, {high.x, 0.3, high.z}, 0.0007, 5);
  const map::Reader reader = map.reader();
  test::BoundAgent sut(contact::field_of(reader));
  sut.agent.place({-0.3, 0.3, 0.9});
  sut.agent.wander(3);
  std::vector<double> times_us;
  for (int i = 0; i < 1800; ++i) {
    const double start = thread_time_us();
    (void)sut.step();
    times_us.push_back(thread_time_us() - start);
  }
  std::sort(times_us.begin(), times_us.end());
  const auto probes = static_cast<double>(sut.agent.grid().probes());
  double sum_us = 0;
  for (const double t : times_us) sum_us += t;
  std::printf(
      "agent step: mean %.1f us, p50 %.1f us, p99 %.1f us, max %.1f us; %.1f probes a step; %zu bytes\n",
      sum_us / 1800, times_us[900], times_us[1782], times_us.back(), probes / 1800, Agent::bytes_needed());
  EXPECT_GT(probes, 10000);
}

TEST(AgentLatency, GameThatSeeksAPlaceAndThenHasOneWanderer) {
  const auto scene = hal::synthetic::make_scene(hal::synthetic::SceneId::bedroom);
  const Vec3d low = scene.room_min_m(), high = scene.room_max_m();
  const test::FilledMap map([&](const Vec3d& p) { return scene.distance(p); },
                            [&](const Vec3d& p) { return static_cast<MaterialId>(scene.material(p)); },
                            {low.x, -0.05, low.z}, {high.x, 0.3, high.z}, 0.0007, 5);
  const map::Reader reader = map.reader();
  Walker walker;
  walker.when.at_frame = 1;
  test::WalkingSession sut(contact::field_of(reader), test::script_of({walker}));
  sut.view = test::looking_ahead({-0.3, 1.4, 1.9});
  std::vector<double> placing_us, walking_us;
  for (int i = 0; i < 1800; ++i) {
    const bool was_placed = sut.pose().is_placed;
    const double start = thread_time_us();
    sut.run(1);
    (was_placed ? walking_us : placing_us).push_back(thread_time_us() - start);
  }
  ASSERT_FALSE(walking_us.empty());
  for (std::vector<double>* times_us : {&placing_us, &walking_us}) {
    std::sort(times_us->begin(), times_us->end());
    std::printf("game round, %s: %zu rounds, p50 %.1f us, p99 %.1f us, max %.1f us\n",
                times_us == &placing_us ? "placing" : "walking", times_us->size(), (*times_us)[times_us->size() / 2],
                (*times_us)[times_us->size() * 99 / 100], times_us->back());
  }
  EXPECT_GT(sut.pose().walked_m, 2);
}

}  // namespace
}  // namespace tactus::interact
