// What a step costs; run alone on a quiet machine. Prints, and asserts only that the work was done.
#include <gtest/gtest.h>

#include <algorithm>
#include <ctime>
#include <vector>

#include "tests/pipeline/contact/analytic_field.hpp"

namespace tactus::contact {
namespace {

double thread_time_us() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) * 1e6 + static_cast<double>(t.tv_nsec) * 1e-3;
}

void measure(const char* name, int bodies_count, bool awake) {
  test::AnalyticField scene([](const Vec3d& p) { return p.y; });
  auto sut = std::make_unique<test::BoundWorld>(scene.field());
  for (int i = 0; i < bodies_count; ++i) {
    BodySpec spec;
    spec.shape = i % 2 == 0 ? Shape::sphere(0.06) : Shape::box({0.05, 0.06, 0.07});
    spec.position_world_m = {0.2 * (i % 7), 0.1 + 0.01 * (i / 7), 0.2 * (i / 7)};
    sut->spawn(spec);
  }
  sut->run(2);
  std::vector<double> times_us;
  for (int i = 0; i < 1200; ++i) {
    if (awake) sut->world.wake_all();
    const double start = thread_time_us();
    sut->run_step();
    times_us.push_back(thread_time_us() - start);
  }
  std::sort(times_us.begin(), times_us.end());
  std::printf("contact step, %d bodies %s: p50 %.1f us, p99 %.1f us, max %.1f us, contacts at most %zu\n",
              bodies_count, name, times_us[600], times_us[1188], times_us.back(),
              sut->world.counters().contacts_max);
  EXPECT_EQ(sut->world.bodies().size(), static_cast<std::size_t>(bodies_count));
}

TEST(ContactLatency, FiftyBodiesAwakeInContact) { measure("awake in contact", 50, true); }
TEST(ContactLatency, FiftyBodiesAsleep) { measure("asleep", 50, false); }
TEST(ContactLatency, OneBall) { measure("awake in contact", 1, true); }

}  // namespace
}  // namespace tactus::contact
