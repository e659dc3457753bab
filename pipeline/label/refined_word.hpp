// What the 3D CRF found about one cell, in 24 bits: its two most likely materials and their marginals.
//
//   bits  0-4   most likely material       5-9    second
//   bits 10-16  its marginal in 1/127      17-23   the second's
//   0           never refined
//
// The other 21 share what is left evenly: mean field over a room leaves under 2 % there in most cells.
// Integers on every path that makes a word. Every function: any phase, any thread, no heap, no lock.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>

#include "pipeline/label/material.hpp"

namespace tactus::label {

using RefinedWord = std::uint32_t;
inline constexpr std::uint32_t kRefinedOne = 127;

/// Marginals of any positive sum; the largest must be positive and finite. Ties: the lower id first.
[[nodiscard]] inline RefinedWord refined_word(std::span<const float, kMaterialCount> marginals) noexcept {
  std::uint32_t first = 0, second = 1;
  if (marginals[1] > marginals[0]) std::swap(first, second);
  float sum = marginals[0] + marginals[1];
  for (std::uint32_t m = 2; m < kMaterialCount; ++m) {
    sum += marginals[m];
    if (marginals[m] > marginals[first]) {
      second = first;
      first = m;
    } else if (marginals[m] > marginals[second]) {
      second = m;
    }
  }
  const float scale = static_cast<float>(kRefinedOne) / sum;
  // The first is at least 1/23, so that no word is 0.
  const auto p = std::clamp(static_cast<std::uint32_t>(marginals[first] * scale + 0.5F), 1U, kRefinedOne);
  const auto q = std::min(static_cast<std::uint32_t>(marginals[second] * scale + 0.5F), kRefinedOne - p);
  return first | second << 5 | p << 10 | q << 17;
}

/// kUnknownMaterial for 0.
[[nodiscard]] constexpr MaterialId refined_best(RefinedWord word) noexcept {
  return word == 0 ? kUnknownMaterial : static_cast<MaterialId>(word & 31U);
}

/// Marginal of refined_best(); 0 for 0.
[[nodiscard]] constexpr float refined_confidence(RefinedWord word) noexcept {
  return static_cast<float>(word >> 10 & 127U) / static_cast<float>(kRefinedOne);
}

/// Sums to 1 (to rounding). word must not be 0.
inline void refined_decode(RefinedWord word, MaterialDistribution& distribution) noexcept {
  constexpr float kUnit = 1.0F / static_cast<float>(kRefinedOne);
  const float p = static_cast<float>(word >> 10 & 127U) * kUnit, q = static_cast<float>(word >> 17) * kUnit;
  distribution.fill((1 - p - q) / (kMaterialCount - 2));
  distribution[word >> 5 & 31U] = q;
  distribution[word & 31U] = p;
}

}  // namespace tactus::label
