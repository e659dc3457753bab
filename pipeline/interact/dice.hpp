// Numbers that look random and are the same on every machine.
#pragma once

#include <cmath>
#include <cstdint>

#include "hal/transform.hpp"

namespace tactus::interact {

/// xorshift64* (Vigna 2016). Wait-free, any phase.
class Dice {
 public:
  explicit Dice(std::uint64_t seed) : state_(seed * 0x9E3779B97F4A7C15ull + 0x632BE59BD9B4E019ull) {}

  std::uint32_t next() noexcept {
    state_ ^= state_ >> 12;
    state_ ^= state_ << 25;
    state_ ^= state_ >> 27;
    return static_cast<std::uint32_t>((state_ * 0x2545F4914F6CDD1Dull) >> 32);
  }
  double between(double low, double high) noexcept { return low + (high - low) * (next() * (1.0 / 4294967296.0)); }

  /// Evenly over the half sphere about a unit normal; the rejection is bounded, its failure once in 10^5 answers the
  /// normal.
  Vec3d above(const Vec3d& normal) noexcept {
    for (int i = 0; i < 16; ++i) {
      const Vec3d v{between(-1, 1), between(-1, 1), between(-1, 1)};
      const double length2 = v.dot(v);
      if (length2 > 1 || length2 < 0.01) continue;
      const Vec3d unit = v * (1 / std::sqrt(length2));
      return unit.dot(normal) < 0 ? -unit : unit;
    }
    return normal;
  }

 private:
  std::uint64_t state_;
};

}  // namespace tactus::interact
