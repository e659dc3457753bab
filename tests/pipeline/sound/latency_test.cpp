// What a block of sound costs; run alone on a quiet machine. Prints, and asserts only that the work was done.
#include <gtest/gtest.h>

#include <ctime>
#include <vector>

#include "pipeline/sound/impact_sound.hpp"
#include "tests/pipeline/sound/sounding_materials.hpp"

namespace tactus::sound {
namespace {

double time_us(clockid_t clock) {
  timespec t{};
  clock_gettime(clock, &t);
  return static_cast<double>(t.tv_sec) * 1e6 + static_cast<double>(t.tv_nsec) * 1e-3;
}

TEST(SoundLatency, OneClip) {
  const contact::MaterialTable table = test::sounding_materials();
  std::vector<float> clip(kClipSamplesMax);
  for (const auto name : {"metal", "glass", "ceramic", "wood", "fabric"}) {
    Strike strike;
    strike.body_material = strike.surface_material = test::id_of(name);
    strike.impulse_n_s = 0.2;
    strike.speed_m_per_s = 2;
    std::size_t samples_count = 0;
    const double start_us = time_us(CLOCK_THREAD_CPUTIME_ID);
    for (int i = 0; i < 100; ++i) samples_count = synthesize(spectrum_of(strike, table), 1, clip);
    const double each_us = (time_us(CLOCK_THREAD_CPUTIME_ID) - start_us) / 100;
    std::printf("clip of %s on %s: %zu samples, %.0f us\n", name, name, samples_count, each_us);
    EXPECT_GT(samples_count, 0U);
  }
}

}  // namespace
}  // namespace tactus::sound
