#include "pipeline/sound/impact_sound.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "tests/pipeline/sound/signal.hpp"
#include "tests/pipeline/sound/sounding_materials.hpp"

namespace tactus::sound {
namespace {

using test::id_of;

Strike strike_of(std::string_view body, std::string_view surface) {
  Strike strike;
  strike.body_material = id_of(body);
  strike.surface_material = id_of(surface);
  strike.impulse_n_s = 0.1;
  strike.speed_m_per_s = 2;
  return strike;
}

std::vector<float> clip_of(const Strike& strike,
                           const contact::MaterialTable& table = test::sounding_materials()) {
  std::vector<float> clip(kClipSamplesMax);
  clip.resize(synthesize(spectrum_of(strike, table), strike.seed, clip));
  return clip;
}

TEST(ImpactSound, LowestModeOfTheBody_SpectrumPeaksThere) {
  for (const double size_m : {0.05, 0.1, 0.2}) {
    // A surface a thousand times as stiff takes no share, so that the body is heard alone.
    contact::MaterialTable table = test::sounding_materials();
    table.properties[id_of("painted")].youngs_modulus_pa = 1e15;
    Strike strike = strike_of("glass", "painted");
    strike.body_size_m = size_m;
    const double expected_hz = 2100 * 0.1 / size_m;
    const auto clip = clip_of(strike, table);
    ASSERT_GT(clip.size(), 9600U);
    const auto early = std::span(clip).first(9600);
    EXPECT_NEAR(test::peak_hz(early, 0.8 * expected_hz, 1.15 * expected_hz, 2), expected_hz,
                0.03 * expected_hz);
    EXPECT_NEAR(test::peak_hz(early, 1.2 * expected_hz, 1.4 * expected_hz, 2), 1.264 * expected_hz,
                0.03 * expected_hz);
  }
}

TEST(ImpactSound, SurfaceSoftestOfTheTwo_ItsModesAreHeardMore) {
  const auto clip = clip_of(strike_of("metal", "wood"));
  const auto early = std::span(clip).first(std::min<std::size_t>(clip.size(), 4800));
  EXPECT_GT(test::magnitude_at(early, 600 / 3.0), test::magnitude_at(early, 1100));
}

TEST(ImpactSound, ModesFallBySixtyDecibelsInTheTimeOfTheTable) {
  for (const double loss : {0.002, 0.005, 0.02}) {
    contact::MaterialTable table = test::sounding_materials();
    table.sound[id_of("glass")].loss_factor = loss;
    const auto clip = clip_of(strike_of("glass", "glass"), table);
    const double expected_s = 2.2 / (2100 * loss);
    const auto window = static_cast<std::size_t>(std::min(0.3 * expected_s, 0.1) * test::kRateHz);
    const std::size_t later = window;
    ASSERT_GT(clip.size(), window + later);
    const double first = test::magnitude_at(std::span(clip).first(window), 2100);
    const double second = test::magnitude_at(std::span(clip).subspan(later, window), 2100);
    const double t60_s = 60 / (20 * std::log10(first / second)) * static_cast<double>(later) / test::kRateHz;
    EXPECT_NEAR(t60_s, expected_s, 0.1 * expected_s) << loss;
  }
}

TEST(ImpactSound, MaterialsAreToldApartByPitchOrDecay) {
  const std::vector<std::string_view> names = {"glass", "metal", "wood", "fabric", "ceramic"};
  std::vector<double> centroids_hz, durations_s;
  for (const auto name : names) {
    const auto clip = clip_of(strike_of(name, name));
    centroids_hz.push_back(
        test::centroid_hz(std::span(clip).first(std::min<std::size_t>(clip.size(), 12000))));
    durations_s.push_back(test::duration_s(clip));
    std::printf("%-8s centroid %6.0f Hz, 99.9 %% of the energy in %5.0f ms, peak %.3f\n", name.data(),
                centroids_hz.back(), 1000 * durations_s.back(), static_cast<double>(test::loudest(clip)));
  }
  // Half an octave of centroid or a factor of 1.5 in decay: several times what listeners just notice.
  for (std::size_t a = 0; a < names.size(); ++a)
    for (std::size_t b = a + 1; b < names.size(); ++b)
      EXPECT_TRUE(std::abs(std::log2(centroids_hz[a] / centroids_hz[b])) > 0.5 ||
                  std::abs(std::log(durations_s[a] / durations_s[b])) > std::log(1.5))
          << names[a] << " and " << names[b];
}

TEST(ImpactSound, SoftPartner_DullerThanAHardOne) {
  const auto on_glass = clip_of(strike_of("glass", "glass"));
  const auto on_carpet = clip_of(strike_of("glass", "carpet"));
  EXPECT_LT(2 * test::centroid_hz(on_carpet), test::centroid_hz(std::span(on_glass).first(12000)));
  EXPECT_GT(spectrum_of(strike_of("glass", "carpet"), test::sounding_materials()).contact_time_s,
            10 * spectrum_of(strike_of("glass", "glass"), test::sounding_materials()).contact_time_s);
}

TEST(ImpactSound, ContactTimeOfTwoSteelBallsAsHertzSays) {
  // A steel ball of 2 cm against a steel wall at 1 m/s: m = 33 g, E* = 110 GPa, R = 1 cm.
  Strike strike = strike_of("metal", "metal");
  strike.body_size_m = 0.02;
  strike.speed_m_per_s = 1;
  strike.impulse_n_s = 0.033 * 1.5;
  const double expected = 2.87 * std::pow(0.033 * 0.033 / (0.01 * 1.1e11 * 1.1e11 * 1), 0.2);
  EXPECT_NEAR(spectrum_of(strike, test::sounding_materials()).contact_time_s, expected, 0.01 * expected);
}

TEST(ImpactSound, StrongerImpact_Louder) {
  for (const auto name : {"glass", "metal", "wood", "fabric", "ceramic"}) {
    double before = 0;
    for (double impulse = 0.001; impulse < 30; impulse *= 1.5) {
      Strike strike = strike_of(name, "wood");
      strike.impulse_n_s = impulse;
      const StrikeSpectrum spectrum = spectrum_of(strike, test::sounding_materials());
      double amplitude = spectrum.noise_amplitude;
      for (int i = 0; i < spectrum.modes_count; ++i)
        amplitude += spectrum.modes[static_cast<std::size_t>(i)].amplitude;
      EXPECT_LE(amplitude, 1);
      // A heavier body stays in contact longer, which takes treble from its modes; the noise is the level
      // itself.
      const double level = spectrum.noise_amplitude;
      EXPECT_GT(level, before) << name << " " << impulse;
      before = level;
    }
  }
}

TEST(ImpactSound, TwiceAsLoudBelowTheKnee_FourTimesTheEnergy) {
  Strike strike = strike_of("wood", "wood");
  strike.energy_j = 0.001, strike.impulse_n_s = 0.0001;
  const float quiet = test::loudest(clip_of(strike));
  strike.energy_j = 0.004;
  EXPECT_NEAR(static_cast<double>(test::loudest(clip_of(strike)) / quiet), 2, 0.02);
}

TEST(ImpactSound, AnyStrike_BoundedAndEndsInSilence) {
  std::mt19937 random(3);
  const contact::MaterialTable table = contact::default_material_table();
  const auto uniform = [&random] { return static_cast<double>(random()) / 4294967296.0; };
  for (int i = 0; i < 300; ++i) {
    Strike strike;
    strike.body_material = static_cast<MaterialId>(random() % kMaterialCount);
    strike.surface_material =
        static_cast<MaterialId>(i % 10 == 0 ? kUnknownMaterial : random() % kMaterialCount);
    strike.body_size_m = std::pow(10, -3 + 4 * uniform());
    strike.impulse_n_s = std::pow(10, -5 + 8 * uniform());
    strike.speed_m_per_s = std::pow(10, -4 + 6 * uniform());
    strike.seed = static_cast<std::uint32_t>(random());
    const auto clip = clip_of(strike, table);
    ASSERT_LE(clip.size(), kClipSamplesMax);
    if (clip.empty()) continue;
    float most = 0;
    for (const float x : clip) {
      ASSERT_TRUE(std::isfinite(x)) << i;
      most = std::max(most, std::abs(x));
    }
    EXPECT_LE(most, 1) << i;
    EXPECT_EQ(clip.back(), 0) << i;
    EXPECT_LT(std::abs(clip[clip.size() - 2]), 0.001F) << i;
    EXPECT_LT(std::abs(clip[0]), 0.05F) << "a click, strike " << i;
  }
}

TEST(ImpactSound, SameStrike_SameBits_AnotherSeedAnotherGrain) {
  Strike strike = strike_of("wood", "painted");
  const auto first = clip_of(strike), again = clip_of(strike);
  EXPECT_EQ(first, again);
  strike.seed = 2;
  EXPECT_NE(first, clip_of(strike));
}

TEST(ImpactSound, NoEnergyOrNoNumber_NoSound) {
  Strike strike = strike_of("wood", "wood");
  strike.impulse_n_s = 0;
  EXPECT_TRUE(clip_of(strike).empty());
  strike = strike_of("wood", "wood");
  strike.speed_m_per_s = NAN;
  EXPECT_TRUE(clip_of(strike).empty());
  strike = strike_of("wood", "wood");
  strike.body_size_m = 0;
  EXPECT_TRUE(clip_of(strike).empty());
}

}  // namespace
}  // namespace tactus::sound
