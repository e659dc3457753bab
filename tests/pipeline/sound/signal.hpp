// Measuring signals by definition: power at a frequency, centroid of a spectrum, fall of an envelope.
#pragma once

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <span>
#include <vector>

namespace tactus::sound::test {

inline constexpr double kRateHz = 48000;

/// Magnitude of the Hann-windowed Fourier sum at one frequency.
inline double magnitude_at(std::span<const float> samples, double frequency_hz) {
  std::complex<double> sum = 0, turn = 1;
  const std::complex<double> step = std::polar(1.0, -2 * std::numbers::pi * frequency_hz / kRateHz);
  const auto n = static_cast<double>(samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double window = 0.5 - 0.5 * std::cos(2 * std::numbers::pi * (static_cast<double>(i) + 0.5) / n);
    sum += window * static_cast<double>(samples[i]) * turn;
    turn *= step;
  }
  return std::abs(sum);
}

/// Strongest frequency between two, on a grid of `step_hz`.
inline double peak_hz(std::span<const float> samples, double low_hz, double high_hz, double step_hz) {
  double best = low_hz, most = -1;
  for (double f = low_hz; f <= high_hz; f += step_hz)
    if (const double m = magnitude_at(samples, f); m > most) {
      most = m;
      best = f;
    }
  return best;
}

/// Mean frequency weighted by power, on third-octave steps of a 24th.
inline double centroid_hz(std::span<const float> samples) {
  double weighted = 0, sum = 1e-30;
  for (double f = 40; f < 20000; f *= std::exp2(1.0 / 24)) {
    const double m = magnitude_at(samples, f);
    weighted += f * m * m * f;  // a step is as wide as its frequency
    sum += m * m * f;
  }
  return weighted / sum;
}

inline double energy(std::span<const float> samples) {
  double sum = 0;
  for (const float x : samples) sum += static_cast<double>(x) * static_cast<double>(x);
  return sum;
}

/// Seconds until all but a thousandth of the energy has been heard.
inline double duration_s(std::span<const float> samples) {
  const double all = energy(samples);
  double sum = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    sum += static_cast<double>(samples[i]) * static_cast<double>(samples[i]);
    if (sum >= 0.999 * all) return static_cast<double>(i) / kRateHz;
  }
  return static_cast<double>(samples.size()) / kRateHz;
}

inline float loudest(std::span<const float> samples) {
  float most = 0;
  for (const float x : samples) most = std::max(most, std::abs(x));
  return most;
}

}  // namespace tactus::sound::test
