// exp() made of + and * alone: bit-identical on every IEEE machine, which libm's is not.
#pragma once

#include <bit>
#include <cstdint>

namespace tactus::segment {

/// exp(x) for finite x; 0 below -87, held at exp(88) above 88. Relative error < 2e-7 (test: against long
/// double). Range reduction by ln 2 in two parts (Cody and Waite), then a Taylor polynomial of degree 7 on
/// |r| <= ln 2 / 2, whose remainder r^8 / 8! is below 6e-9. Phase: any.
constexpr float exponential(float x) noexcept {
  if (!(x > -87.0F)) return 0;
  if (x > 88.0F) x = 88.0F;
  const float scaled = x * 1.44269504F;
  const auto n = static_cast<std::int32_t>(scaled < 0 ? scaled - 0.5F : scaled + 0.5F);
  const float k = static_cast<float>(n);
  const float r = (x - k * 0.693359375F) - k * -2.12194440e-4F;
  float p = 1.0F / 5040.0F;
  p = p * r + 1.0F / 720.0F;
  p = p * r + 1.0F / 120.0F;
  p = p * r + 1.0F / 24.0F;
  p = p * r + 1.0F / 6.0F;
  p = p * r + 0.5F;
  p = p * r + 1.0F;
  p = p * r + 1.0F;
  return p * std::bit_cast<float>(static_cast<std::uint32_t>(n + 127) << 23);
}

}  // namespace tactus::segment
