// Functions whose result is the same bits on every IEEE machine: + - * / in a fixed order, integer hashes, no
// libm.
#pragma once

#include <cstdint>

namespace tactus::hal::synthetic {

inline constexpr double kPi = 3.14159265358979323846;
inline constexpr double kRadiansPerDegree = kPi / 180.0;

struct SinCos {
  double sin = 0, cos = 1;
};

/// Sine and cosine of `turns` full turns (1 = 360 degrees), |turns| < 2^30. Taylor polynomials on an eighth
/// of a turn: the first term left out is (pi/4)^17/17! = 5e-17. Any phase, any thread.
constexpr SinCos sin_cos_turns(double turns) {
  const double scaled = turns * 4;
  const auto quarter = static_cast<std::int64_t>(scaled < 0 ? scaled - 0.5 : scaled + 0.5);
  const double x = (scaled - static_cast<double>(quarter)) * (kPi / 2);
  const double x2 = x * x;
  double s = 1.0 / 1307674368000.0;  // 15!
  s = 1.0 / 6227020800.0 - x2 * s;
  s = 1.0 / 39916800.0 - x2 * s;
  s = 1.0 / 362880.0 - x2 * s;
  s = 1.0 / 5040.0 - x2 * s;
  s = 1.0 / 120.0 - x2 * s;
  s = 1.0 / 6.0 - x2 * s;
  s = x * (1.0 - x2 * s);
  double c = 1.0 / 20922789888000.0;  // 16!
  c = 1.0 / 87178291200.0 - x2 * c;
  c = 1.0 / 479001600.0 - x2 * c;
  c = 1.0 / 3628800.0 - x2 * c;
  c = 1.0 / 40320.0 - x2 * c;
  c = 1.0 / 720.0 - x2 * c;
  c = 1.0 / 24.0 - x2 * c;
  c = 1.0 / 2.0 - x2 * c;
  c = 1.0 - x2 * c;
  switch (quarter & 3) {
    case 0:
      return {s, c};
    case 1:
      return {c, -s};
    case 2:
      return {-s, -c};
    default:
      return {-c, s};
  }
}

constexpr SinCos sin_cos_degrees(double degrees) { return sin_cos_turns(degrees / 360.0); }

/// Finaliser of SplitMix64 (Steele et al. 2014): a counter in, 64 independent-looking bits out.
constexpr std::uint64_t hash64(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

/// [0, 1) from 24 of the hash's bits.
constexpr float uniform01(std::uint64_t bits) {
  return static_cast<float>(bits >> 40) * (1.0F / 16777216.0F);
}

}  // namespace tactus::hal::synthetic
