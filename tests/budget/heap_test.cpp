// The spine must not touch the heap once it runs.
#include <gtest/gtest.h>

#include <cstdlib>

#include "firmware_host/bench_spine.hpp"
#include "pipeline/profile.hpp"
#include "rt/heap_guard.hpp"

namespace tactus {
namespace {

TEST(HeapBudget, SixtyFramesOfTheSyntheticRoomMakeNoHeapCall) {
  if (!rt::heap_guard::is_active()) GTEST_SKIP() << "the sanitizer owns the heap in this build";
  constexpr std::size_t kFramesCount = 60;
  const firmware::BenchFrames frames = firmware::render_bench_frames(kFramesCount);
  const auto pass = firmware::run_bench_pass(frames, x86_profile().spine, 0, 0);
  ASSERT_TRUE(pass) << pass.error().message;
  EXPECT_EQ(pass->cpu_ms[firmware::kBenchTotal].size(), kFramesCount);
  EXPECT_EQ(pass->frames_lost, 0U);
  EXPECT_TRUE(pass->heap_is_guarded);
  EXPECT_EQ(pass->heap_calls, 0U);

  // That the guard would have seen one.
  rt::heap_guard::seal();
  const std::uint64_t before = rt::heap_guard::was_total_calls();
  {
    const rt::RtScope scope;
    void* volatile block = std::malloc(8);
    std::free(block);
  }
  EXPECT_EQ(rt::heap_guard::was_total_calls(), before + 1);
  rt::heap_guard::unseal();
}

}  // namespace
}  // namespace tactus
