#include "pipeline/sound/impact_sound.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tactus::sound {
namespace {

constexpr double kRateHz = kSampleRateHz;
// Free plate, sides 4 : 5, Poisson's ratio 0.3, Ritz with Legendre polynomials to degree 11 (for a square
// plate it gives 1, 1.455, 1.802, 2.584 as in Leissa 1969, Vibration of Plates). A square would have pairs at
// one pitch.
constexpr std::array<double, kModesPerPart> kPlateRatios = {1,     1.264, 2.081, 2.407,
                                                            2.825, 3.668, 4.676, 4.787};
constexpr double kPieceM = 0.1;         // that the table's mode_frequency_hz is for
constexpr double kSurfacePieceM = 0.3;  // of a wall or a table sounds around the place that is hit
constexpr double kHighestModeHz = 18000;
constexpr double kFullEnergyJ = 0.25;
constexpr double kPoisson = 0.3;
constexpr double kContactTimeLeastS = 20e-6, kContactTimeMostS = 15e-3;
constexpr double kNoiseDecayLeastS = 4e-3;
constexpr double kInaudible = 3e-5;  // -90 dB of full scale
constexpr std::size_t kFadeSamples = kSampleRateHz / 20;

// xorshift32, Marsaglia 2003; the first numbers of small seeds are alike, hence the mixing.
class Random {
 public:
  explicit Random(std::uint32_t seed) : state_((seed ^ 0x9E3779B9U) * 0x85EBCA6BU | 1U) {
    for (int i = 0; i < 4; ++i) next();
  }
  double next() {  // in [-1, 1)
    state_ ^= state_ << 13;
    state_ ^= state_ >> 17;
    state_ ^= state_ << 5;
    return static_cast<double>(state_) / 2147483648.0 - 1;
  }

 private:
  std::uint32_t state_;
};

// Spectrum of half a sine of length t, 1 at frequency 0. Beyond its first zero the envelope: the force of a
// real contact is not so exact that a mode would stay silent in a zero.
double half_sine_spectrum(double frequency_hz, double t) {
  const double u = frequency_hz * t;
  const double v = 1 - 4 * u * u;
  if (std::abs(v) < 1e-3) return std::numbers::pi / 4;
  return (u < 1 ? std::abs(std::cos(std::numbers::pi * u)) : 1) / std::abs(v);
}

double contact_time_s(const Strike& strike, double modulus_body_pa, double modulus_surface_pa) {
  const double speed = std::max(strike.speed_m_per_s, 0.01);
  // The impulse is m v (1 + e); e = 0.5 stands for all, which is wrong by at most 15 % of the time.
  const double mass = std::max(strike.impulse_n_s, 1e-6) / (1.5 * speed);
  const double modulus = 1 / ((1 - kPoisson * kPoisson) * (1 / modulus_body_pa + 1 / modulus_surface_pa));
  const double t = 2.87 * std::pow(mass * mass / (0.5 * strike.body_size_m * modulus * modulus * speed), 0.2);
  return std::clamp(t, kContactTimeLeastS, kContactTimeMostS);
}

struct Part {
  contact::SoundProperties sound;
  double size_m;
  double amplitude;  // square root of its share of the energy
};

// Adds the part's modes with amplitudes that sum to at most `amplitude`.
void add_modes(const Part& part, double amplitude, Random& random, StrikeSpectrum& spectrum) {
  std::array<double, kModesPerPart> answers{};
  double sum = 0;
  for (double& answer : answers) sum += answer = 0.75 + 0.25 * random.next();
  for (std::size_t i = 0; i < answers.size(); ++i) {
    Mode mode;
    mode.frequency_hz = part.sound.mode_frequency_hz * kPieceM / part.size_m * kPlateRatios[i];
    if (!(mode.frequency_hz <= kHighestModeHz)) break;
    mode.decay_per_s = std::numbers::pi * mode.frequency_hz * part.sound.loss_factor;
    mode.amplitude =
        amplitude * answers[i] / sum * half_sine_spectrum(mode.frequency_hz, spectrum.contact_time_s);
    spectrum.modes[static_cast<std::size_t>(spectrum.modes_count++)] = mode;
  }
}

// Samples until `amplitude` has fallen to silence.
std::size_t samples_of(double amplitude, double decay_per_s, std::size_t most) {
  if (!(amplitude > kInaudible)) return 0;
  const double samples = std::log(amplitude / kInaudible) / decay_per_s * kRateHz;
  return samples < static_cast<double>(most) ? static_cast<std::size_t>(samples) + 1 : most;
}

// Four decaying sines at a time, each a two-pole resonator after an impulse: the recurrences are independent,
// so the processor works on all while one waits.
struct Resonators {
  std::array<double, 4> gain1{}, gain2{}, last{}, before_last{};
  std::size_t samples_count = 0;

  void set(std::size_t lane, const Mode& mode) {
    const double angle = 2 * std::numbers::pi * mode.frequency_hz / kRateHz;
    const double radius = std::exp(-mode.decay_per_s / kRateHz);
    gain1[lane] = 2 * radius * std::cos(angle);
    gain2[lane] = -radius * radius;
    last[lane] = 0;  // sample 0
    before_last[lane] = -mode.amplitude * std::sin(angle) / radius;
  }

  void add_to(std::span<float> out) {
    for (float& sample : out.first(samples_count)) {
      double sum = 0;
      for (std::size_t lane = 0; lane < 4; ++lane) {
        sum += last[lane];
        const double next = gain1[lane] * last[lane] + gain2[lane] * before_last[lane];
        before_last[lane] = last[lane];
        last[lane] = next;
      }
      sample += static_cast<float>(sum);
    }
  }
};

void add_noise(const StrikeSpectrum& spectrum, Random& random, std::span<float> out) {
  const double keep = std::exp(-2 * std::numbers::pi * spectrum.noise_cutoff_hz / kRateHz);
  const double take = 1 - keep;
  // Two equal one-pole filters leave this much of a uniform number's root mean square of 0.577. Raised
  // towards 0.35, by no more than 12 dB, so that soft contacts are dull but not gone.
  const double left = 0.577 * take * take * std::sqrt((1 + keep * keep) / std::pow(1 - keep * keep, 3));
  const double gain = std::min(4.0, 0.35 / left);
  const double fall = std::exp(-1 / (spectrum.noise_decay_s * kRateHz));
  const double rise_samples = std::max(1.0, 0.5 * spectrum.contact_time_s * kRateHz);
  double once = 0, twice = 0, envelope = spectrum.noise_amplitude;
  for (std::size_t i = 0; i < out.size(); ++i) {
    once += take * (random.next() - once);
    twice += take * (once - twice);
    const double rise = std::min(1.0, static_cast<double>(i) / rise_samples);
    out[i] += static_cast<float>(envelope * rise * std::clamp(gain * twice, -1.0, 1.0));
    envelope *= fall;
  }
}

}  // namespace

StrikeSpectrum spectrum_of(const Strike& strike, const contact::MaterialTable& table) noexcept {
  StrikeSpectrum spectrum;
  const double work_j = 0.5 * strike.impulse_n_s * strike.speed_m_per_s;
  const double energy_j = std::max(strike.energy_j, work_j);
  if (!std::isfinite(strike.energy_j + work_j + strike.body_size_m + strike.surface_size_m) ||
      !(energy_j > 0) || !(strike.body_size_m > 0))
    return spectrum;
  const double modulus_body = table.of(strike.body_material).youngs_modulus_pa;
  const double modulus_surface = table.of(strike.surface_material).youngs_modulus_pa;
  spectrum.contact_time_s = contact_time_s(strike, modulus_body, modulus_surface);

  const double share =
      modulus_surface / (modulus_body + modulus_surface);  // of the body: the softer gives more
  const Part body{table.sound_of(strike.body_material), strike.body_size_m, std::sqrt(share)};
  const Part surface{table.sound_of(strike.surface_material),
                     strike.surface_size_m > 0 ? strike.surface_size_m : kSurfacePieceM,
                     std::sqrt(1 - share)};
  const auto tone = [](const Part& part) { return part.amplitude * std::sqrt(1 - part.sound.noise_share); };
  const auto noise = [](const Part& part) { return part.amplitude * std::sqrt(part.sound.noise_share); };
  const double x = std::sqrt(energy_j / kFullEnergyJ);
  const double level = x / std::sqrt(1 + x * x) / (tone(body) + tone(surface) + noise(body) + noise(surface));
  Random random(strike.seed);
  add_modes(body, level * tone(body), random, spectrum);
  add_modes(surface, level * tone(surface), random, spectrum);
  spectrum.noise_amplitude = level * (noise(body) + noise(surface));
  // Half a sine has lost 3 dB at 0.6 / t. Fibres and crumbs rub while they are pressed: even a cushion
  // rustles.
  spectrum.noise_cutoff_hz = std::clamp(0.6 / spectrum.contact_time_s, 300.0, 16000.0);
  spectrum.noise_decay_s = std::max(spectrum.contact_time_s, kNoiseDecayLeastS);
  return spectrum;
}

std::size_t synthesize(const StrikeSpectrum& spectrum, std::uint32_t seed, std::span<float> out) noexcept {
  out = out.first(std::min(out.size(), kClipSamplesMax));
  struct Sounding {
    std::size_t samples;
    const Mode* mode;
  };
  std::array<Sounding, 2 * kModesPerPart> sounding{};
  const auto modes_count = static_cast<std::size_t>(spectrum.modes_count);
  for (std::size_t i = 0; i < modes_count; ++i) {
    const Mode& mode = spectrum.modes[i];
    sounding[i] = {samples_of(mode.amplitude, mode.decay_per_s, out.size()), &mode};
  }
  // Modes of like length share a run of four lanes.
  std::sort(sounding.begin(), sounding.begin() + spectrum.modes_count,
            [](const Sounding& a, const Sounding& b) {
              return a.samples != b.samples ? a.samples > b.samples : a.mode < b.mode;
            });
  const std::size_t noise_samples =
      samples_of(spectrum.noise_amplitude, 1 / std::max(spectrum.noise_decay_s, 1e-6), out.size());
  const std::size_t samples_count = std::max(noise_samples, modes_count > 0 ? sounding[0].samples : 0);
  out = out.first(samples_count);
  std::fill(out.begin(), out.end(), 0.0F);

  for (std::size_t first = 0; first < modes_count; first += 4) {
    Resonators four;
    four.samples_count = sounding[first].samples;
    for (std::size_t lane = 0; lane < 4 && first + lane < modes_count; ++lane)
      four.set(lane, *sounding[first + lane].mode);
    four.add_to(out);
  }
  Random random(seed);
  add_noise(spectrum, random, out.first(noise_samples));

  const std::size_t fade = std::min(kFadeSamples, samples_count / 4);
  for (std::size_t i = 0; i < fade; ++i)
    out[samples_count - 1 - i] *= static_cast<float>(i) / static_cast<float>(fade);
  if (samples_count > 0) out[samples_count - 1] = 0;
  return samples_count;
}

}  // namespace tactus::sound
