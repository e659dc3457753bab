// exp and ln between probabilities and costs of 1/32 nat, as tables that the compiler makes: no libm, hence
// the same bits on every machine.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "pipeline/label/label_cell.hpp"

namespace tactus::label {

/// exp(x) to 1e-15: halved until |x| < 1/64, Taylor to degree 8, squared back.
constexpr double exp_of(double x) {
  int halvings = 0;
  while (x > 0.015625 || x < -0.015625) {
    x /= 2;
    ++halvings;
  }
  double p = 1;
  for (int k = 8; k >= 1; --k) p = 1 + p * x / k;
  for (; halvings > 0; --halvings) p *= p;
  return p;
}

/// ln(y) for y in 0.001 .. 100 by Newton's steps on exp.
constexpr double ln_of(double y) {
  double x = 0;
  for (int i = 0; i < 200; ++i) {
    const double e = exp_of(x), step = 2 * (y - e) / (y + e);
    x += step;
    if (step < 1e-15 && step > -1e-15) break;
  }
  return x;
}

/// exp(-cost) as float.
inline constexpr auto kExp = [] {
  std::array<float, kOtherCostMax + 1> table{};
  for (std::size_t c = 0; c < table.size(); ++c)
    table[c] = static_cast<float>(exp_of(-static_cast<double>(c) / kCostsPerNat));
  return table;
}();

/// exp(-cost) in Q16, 0 from 11.8 nat on.
inline constexpr auto kExpQ16 = [] {
  std::array<std::uint32_t, 384> table{};
  for (std::size_t c = 0; c < table.size(); ++c)
    table[c] = static_cast<std::uint32_t>(65536 * exp_of(-static_cast<double>(c) / kCostsPerNat) + 0.5);
  return table;
}();
static_assert(kExpQ16.front() == 65536 && kExpQ16.back() == 0);

/// Upper ends of the roundings: a probability ratio r costs c when kRatio[c] < r <= kRatio[c - 1].
inline constexpr auto kRatio = [] {
  std::array<float, kOtherCostMax> table{};
  for (std::size_t c = 0; c < table.size(); ++c)
    table[c] = static_cast<float>(exp_of(-(static_cast<double>(c) + 0.5) / kCostsPerNat));
  return table;
}();

/// Nearest cost of a ratio <= 1; kOtherCostMax for anything below its range, 0 and NaN included.
inline std::uint32_t cost_of_ratio(float ratio) noexcept {
  return static_cast<std::uint32_t>(
      std::partition_point(kRatio.begin(), kRatio.end(), [ratio](float end) { return !(ratio > end); }) -
      kRatio.begin());
}

/// Sums of 19 Q16 terms (the largest 1) at which the cost of their mean steps down: element k is where it
/// becomes kMeanCostMax - 1 - k.
inline constexpr std::uint32_t kMeanCostMax = 94;  // 32 ln 19 = 94.2
inline constexpr auto kMeanSum = [] {
  std::array<std::uint32_t, kMeanCostMax> table{};
  for (std::size_t k = 0; k < table.size(); ++k)
    table[k] = static_cast<std::uint32_t>(
        65536 * kOtherMaterials * exp_of(-(static_cast<double>(kMeanCostMax - k) - 0.5) / kCostsPerNat) +
        0.5);
  return table;
}();

/// -32 ln(sum / 19) for a sum in 1 .. 19 (Q16), rounded.
inline std::uint32_t cost_of_mean(std::uint32_t sum_q16) noexcept {
  return kMeanCostMax - static_cast<std::uint32_t>(
                            std::upper_bound(kMeanSum.begin(), kMeanSum.end(), sum_q16) - kMeanSum.begin());
}

/// -32 ln(max(byte, 1/2) / 255), rounded.
inline constexpr auto kCostOfByte = [] {
  std::array<std::uint16_t, 256> table{};
  for (std::size_t b = 0; b < table.size(); ++b) {
    const double p = b == 0 ? 0.5 / 255 : static_cast<double>(b) / 255;
    table[b] = static_cast<std::uint16_t>(-kCostsPerNat * ln_of(p) + 0.5);
  }
  return table;
}();
static_assert(kCostOfByte[255] == 0 && kCostOfByte[1] == 177 && kCostOfByte[0] == 200);

}  // namespace tactus::label
