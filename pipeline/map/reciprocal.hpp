// 1 / x without a division: an integer guess and two Newton steps, the same bits on every machine. A vector division
// blocks its unit for 16 cycles on AVX-512, this takes seven operations that other work overlaps.
//
// The guess, 0x7F000000 less the number's bits, is 2^-e (1 - m/2) for 2^e (1 + m): 1 to 1.125 times 1/x. Newton's step
// r (2 - x r) wants an error centred on 0. Instead of scaling r, which costs a multiplication, the steps carry the
// scale along: r (a - x r) with a = twice the centre of x r squares the relative error (6 % -> 0.17 % -> 1.6e-6). What
// comes out is kReciprocalScale / x, and whoever uses it folds the scale into a constant.
#pragma once

#include <bit>
#include <cstdint>

namespace tactus::map {

inline constexpr std::uint32_t kReciprocalGuess = 0x7F000000;
inline constexpr float kReciprocalSteps[2] = {2.125f, 2.25390625f};
inline constexpr float kReciprocalScale = 1.27002144f;

/// kReciprocalScale / x, relative error below 1.8e-6, for normal positive x up to 1e37; finite or infinite, never a
/// trap, for the others.
inline float scaled_reciprocal(float x) noexcept {
  float r = std::bit_cast<float>(kReciprocalGuess - std::bit_cast<std::uint32_t>(x));
  for (const float a : kReciprocalSteps) r = r * (a - x * r);
  return r;
}

}  // namespace tactus::map
