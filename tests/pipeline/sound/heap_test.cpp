// What the stage does itself, without the mixer: no heap call.
#include <gtest/gtest.h>

#include <optional>
#include <vector>

#include "pipeline/sound/impact_sound.hpp"
#include "rt/heap_guard.hpp"
#include "tests/pipeline/sound/planned_stage.hpp"
#include "tests/pipeline/sound/shoebox.hpp"

namespace tactus::sound {
namespace {

TEST(SoundHeap, ImpactsClipsAndReflectionsWithoutAHeapCall) {
  if (!rt::heap_guard::is_active()) GTEST_SKIP() << "the sanitizer owns the heap in this build";
  const contact::MaterialTable table = test::sounding_materials();
  const test::Shoebox room;
  test::PlannedStage planned(room.rays());
  std::vector<float> clip(kClipSamplesMax), answer(kClipSamplesMax);
  std::array<Reflection, 8> reflections;
  std::size_t samples_count = 0;
  int reflections_count = 0;

  const std::uint64_t before = rt::heap_guard::thread_calls();
  rt::heap_guard::seal();
  rt::heap_guard::set_fatal(true);
  auto no_heap = std::make_optional<rt::RtScope>();
  for (std::uint32_t i = 0; i < 100; ++i) {
    rt::Status added = planned.stage.add(test::impact_of("glass", "wood", {0.01 * i, 1, -1}));
    TACTUS_ASSERT(added == (i < 64 ? rt::Status::ok : rt::Status::full));
    Strike strike;
    strike.body_material = static_cast<MaterialId>(i % kMaterialCount);
    strike.energy_j = 0.1;
    samples_count += synthesize(spectrum_of(strike, table), i, clip);
    reflections_count +=
        find_reflections(room.rays(), table, {{0.5, 1, 0.4}, {}, {-0.5, 1.5, -1}}, 10, reflections);
    apply_bands(reflections[0].gain, clip, answer);
  }
  no_heap.reset();
  rt::heap_guard::set_fatal(false);
  rt::heap_guard::unseal();
  EXPECT_EQ(rt::heap_guard::thread_calls() - before, 0U);
  EXPECT_GT(samples_count, 0U);
  EXPECT_EQ(reflections_count, 600);
}

}  // namespace
}  // namespace tactus::sound
