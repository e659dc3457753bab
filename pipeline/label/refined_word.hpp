// What is known about one cell beyond what keyframes said, in 24 bits: the 3D CRF's two most likely materials
// and their marginals, or what a person pinned.
//
//   bits  0-4   most likely material       5-9    second
//   bits 10-16  its marginal in 1/127      17-23   the second's
//   0           never refined
//   marginals of 0 and 127, which the CRF cannot leave: pinned to the material
//
// The other 21 share what is left evenly: mean field over a room leaves under 2 % there in most cells.
// Integers on every path that makes a word. Every function: any phase, any thread, no heap, no lock.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>

#include "pipeline/label/label_cell.hpp"
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

/// A person's word: certain, whatever keyframes and the CRF say, until it is taken back.
[[nodiscard]] constexpr RefinedWord pinned_word(MaterialId material) noexcept {
  return material | kRefinedOne << 17;
}
[[nodiscard]] constexpr bool is_pinned(RefinedWord word) noexcept { return word >> 10 == kRefinedOne << 7; }

/// kUnknownMaterial for 0.
[[nodiscard]] constexpr MaterialId refined_best(RefinedWord word) noexcept {
  return word == 0 ? kUnknownMaterial : static_cast<MaterialId>(word & 31U);
}

/// What readers take for a cell's material: pinned or refined where it is, else as fused.
[[nodiscard]] constexpr MaterialId seen_material(LabelWord fused, RefinedWord refined) noexcept {
  return refined != 0 ? refined_best(refined) : best(fused);
}

/// Marginal of refined_best(); 0 for 0.
[[nodiscard]] constexpr float refined_confidence(RefinedWord word) noexcept {
  const std::uint32_t p = is_pinned(word) ? kRefinedOne : word >> 10 & 127U;
  return static_cast<float>(p) / static_cast<float>(kRefinedOne);
}

/// Sums to 1 (to rounding). word must not be 0.
inline void refined_decode(RefinedWord word, MaterialDistribution& distribution) noexcept {
  if (is_pinned(word)) {
    distribution.fill(0);
    distribution[word & 31U] = 1;
    return;
  }
  constexpr float kUnit = 1.0F / static_cast<float>(kRefinedOne);
  const float p = static_cast<float>(word >> 10 & 127U) * kUnit, q = static_cast<float>(word >> 17) * kUnit;
  distribution.fill((1 - p - q) / (kMaterialCount - 2));
  distribution[word >> 5 & 31U] = q;
  distribution[word & 31U] = p;
}

/// Whether a word from outside is one that refined_word() or pinned_word() makes, or 0.
[[nodiscard]] constexpr bool is_refined_word(RefinedWord word) noexcept {
  const std::uint32_t first = word & 31U, second = word >> 5 & 31U, p = word >> 10 & 127U, q = word >> 17;
  if (word == 0) return true;
  if (first >= kMaterialCount || second >= kMaterialCount) return false;
  if (is_pinned(word)) return second == 0;
  return first != second && p > 0 && p + q <= kRefinedOne;
}

}  // namespace tactus::label
