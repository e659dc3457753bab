// What a block of sound costs; run alone on a quiet machine. Prints, and asserts only that the work was done.
#include <gtest/gtest.h>

#include <algorithm>
#include <ctime>
#include <vector>

#include "hal/openal/loopback_mixer.hpp"
#include "pipeline/sound/impact_sound.hpp"
#include "tests/pipeline/sound/planned_stage.hpp"
#include "tests/pipeline/sound/shoebox.hpp"
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

/// Processor time of the calling thread and of the whole process, OpenAL's threads in it.
struct Costs {
  std::vector<double> thread_us, process_us;

  template <typename Work>
  void measure(const Work& work) {
    const double thread_start = time_us(CLOCK_THREAD_CPUTIME_ID), start = time_us(CLOCK_PROCESS_CPUTIME_ID);
    work();
    thread_us.push_back(time_us(CLOCK_THREAD_CPUTIME_ID) - thread_start);
    process_us.push_back(time_us(CLOCK_PROCESS_CPUTIME_ID) - start);
  }
  void print(const char* what) {
    std::sort(thread_us.begin(), thread_us.end());
    std::sort(process_us.begin(), process_us.end());
    std::printf("%s: p50 %.2f ms, max %.2f ms; process p50 %.2f ms\n", what,
                thread_us[thread_us.size() / 2] * 1e-3, thread_us.back() * 1e-3,
                process_us[process_us.size() / 2] * 1e-3);
  }
};

TEST(SoundLatency, BlockOf33MillisecondsByVoices) {
  for (const int voices : {0, 1, 8, 16, 32, 64}) {
    auto mixer = hal::openal::LoopbackMixer::create();
    if (!mixer) GTEST_SKIP() << mixer.error().message;
    const std::vector<float> clip(3 * 48000, 0.001F);
    for (int i = 0; i < voices; ++i) ASSERT_EQ(mixer->play({clip, {0.1 * i, 0, -1}, 1, {}}), rt::Status::ok);
    std::vector<float> block(2 * 1600);
    Costs costs;
    for (int i = 0; i < 80; ++i) costs.measure([&] { ASSERT_EQ(mixer->mix(block), rt::Status::ok); });
    char what[64];
    std::snprintf(what, sizeof what, "mix of 1600 sample frames, %d voices", voices);
    costs.print(what);
  }
}

TEST(SoundLatency, EightSoundsWithSixReflectionsBeginInOneBlock) {
  const test::Shoebox room;
  Costs costs;
  for (int i = 0; i < 30; ++i) {
    auto mixer = hal::openal::LoopbackMixer::create();
    if (!mixer) GTEST_SKIP() << mixer.error().message;
    test::PlannedStage planned(room.rays());
    for (int k = 0; k < 8; ++k)
      ASSERT_EQ(planned.stage.add(test::impact_of(k % 2 == 0 ? "metal" : "wood", "glass", {0.1 * k, 1, -1})),
                rt::Status::ok);
    std::vector<float> block(2 * 1600);
    costs.measure([&] {
      ASSERT_EQ(planned.stage.step(test::level_head({0, 1.5, 0}), *mixer, block), rt::Status::ok);
    });
    EXPECT_EQ(planned.stage.counts().sounds, 8U);
    EXPECT_EQ(planned.stage.counts().reflections, 48U);
  }
  costs.print("step that begins 8 sounds with 6 reflections each and mixes 1600 sample frames");
}

}  // namespace
}  // namespace tactus::sound
