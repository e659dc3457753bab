// The posterior over the 23 materials of one 2x2x2 cell, in one 64-bit word (23 floats are 92 bytes).
//
//   bits  0-19   ids of the 4 most likely materials, 5 bits each, best first (ties: the lower id first)
//   bits 20-46   costs of the 2nd to 4th relative to the best, 9 bits each, saturating at 16 nat
//   bits 47-56   cost of the mean probability of the other 19 relative to the best, 10 bits, saturating at 32
//   nat bits 57-63   keyframes fused, saturating at 127 0            nothing observed
//
// A cost is -ln(probability) in 1/32 nat: one step changes the odds by 3 %. Bayes' rule is addition of costs;
// what the word loses is the identity of the 19 unlikely ones (each is taken as their mean) and how far
// behind a runner-up is beyond 16 nat: three contradicting observations of full confidence turn any cell
// over. tests/pipeline/label measures the loss against 23 float64.
//
// Integers on every path that makes a word: the same bits on every machine. Every function: any phase, any
// thread, no heap, no lock.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "pipeline/label/material.hpp"

namespace tactus::label {

using LabelWord = std::uint64_t;

inline constexpr int kKeptMaterials = 4;
inline constexpr int kOtherMaterials = kMaterialCount - kKeptMaterials;
inline constexpr int kCostsPerNat = 32;
inline constexpr std::uint32_t kKeptCostMax = 511;
inline constexpr std::uint32_t kOtherCostMax = 1023;
inline constexpr std::uint32_t kObservationsMax = 127;

/// What one keyframe says about one cell: a cost per material, 1/32 nat, up to a common constant. At most
/// kObservationCostMax.
struct ObservationCosts {
  std::array<std::uint16_t, kMaterialCount> cost{};
};
inline constexpr std::uint16_t kObservationCostMax = 8191;

/// Costs of a network's 23 bytes (255 * probability). A byte of 0 stands for anything below 0.5 / 255 and is
/// taken as that: 6.2 nat, so that one keyframe cannot rule a material out.
[[nodiscard]] ObservationCosts costs_of(std::span<const std::uint8_t, kMaterialCount> probability) noexcept;

/// Bayes' rule, eq. (1) of the paper: posterior ~ prior * likelihood. A prior of 0 is uniform. About 100 ns.
[[nodiscard]] LabelWord fuse(LabelWord prior, const ObservationCosts& observation) noexcept;

/// Direct mapping, the paper's ablation: the observation replaces what was known; only the count goes on.
[[nodiscard]] LabelWord replace(LabelWord prior, const ObservationCosts& observation) noexcept;

/// Whether a word from outside is one that the functions here make: 0, or four different materials in order.
[[nodiscard]] bool is_label_word(LabelWord word) noexcept;

/// The whole distribution, sums to 1 (to rounding); uniform for 0.
void decode(LabelWord word, MaterialDistribution& distribution) noexcept;

/// Relative costs of all 23 (the kept ones their own, the others their mean's); all 0 for word 0.
[[nodiscard]] ObservationCosts costs_in(LabelWord word) noexcept;

/// The nearest word to a distribution (any positive scale; the largest entry must be positive and finite)
/// after n observations. n = 0 gives 0.
[[nodiscard]] LabelWord encode(const MaterialDistribution& distribution, std::uint32_t n) noexcept;

/// kUnknownMaterial for 0.
[[nodiscard]] constexpr MaterialId best(LabelWord word) noexcept {
  return word == 0 ? kUnknownMaterial : static_cast<MaterialId>(word & 31u);
}
/// Probability of best(); 0 for 0.
[[nodiscard]] float confidence(LabelWord word) noexcept;

/// Keyframes fused, 0 to 127.
[[nodiscard]] constexpr std::uint8_t observations(LabelWord word) noexcept {
  return static_cast<std::uint8_t>(word >> 57);
}

}  // namespace tactus::label
