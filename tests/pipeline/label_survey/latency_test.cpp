// What a survey costs; run alone on a quiet machine. Prints, and asserts only that the work was done.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <vector>

#include "tests/pipeline/label_survey/wall_view.hpp"

namespace tactus {
namespace {

double thread_time_us() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) * 1e6 + static_cast<double>(t.tv_nsec) * 1e-3;
}

TEST(LabelSurveyLatency, WholeViewWithThreeKeyframesUnderWay) {
  test::WallView wall;
  wall.label([](const Vec3d& p) { return p.x < 0; }, 2, 1);
  LabelSurveyInput input = wall.input(9);
  const KeyframeUnderWay under_way[] = {
      {{}, wall.half_depth_m}, {{}, wall.half_depth_m}, {{}, wall.half_depth_m}};
  input.under_way = under_way;
  input.T_world_before = input.T_world_keyframe = T_WorldDepth{};
  for (const std::size_t other_bytes : {std::size_t{0}, std::size_t{8} << 20}) {
    std::vector<char> other_work(other_bytes);  // what a frame's other stages leave in the caches, at worst
    std::vector<double> times_us;
    std::size_t surface_count = 0;
    for (int i = 0; i < 300; ++i) {
      for (std::size_t line = 0; line < other_work.size(); line += 64) ++other_work[line];
      const double start = thread_time_us();
      surface_count += survey_labels(input).surface_count;
      times_us.push_back(thread_time_us() - start);
    }
    std::sort(times_us.begin(), times_us.end());
    std::printf("label survey, %zu rays, 3 keyframes under way, %s caches: p50 %.1f us, p99 %.1f us\n",
                kSurveySamples, other_bytes > 0 ? "cold" : "warm", times_us[150], times_us[297]);
    EXPECT_EQ(surface_count, 300u * kSurveySamples);
  }
}

}  // namespace
}  // namespace tactus
