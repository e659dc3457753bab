// Places along a Morton curve: points near on it are near in space, and share lattice vertices while these
// are in the cache.
#pragma once

#include <cstdint>

namespace tactus::label {

namespace detail {
/// The low 10 bits of v, two zeros between each.
constexpr std::uint32_t spread_bits(std::uint32_t v) {
  v &= 0x3FF;
  v = (v | v << 16) & 0x30000FF;
  v = (v | v << 8) & 0x300F00F;
  v = (v | v << 4) & 0x30C30C3;
  return (v | v << 2) & 0x9249249;
}
static_assert(spread_bits(0x3FF) == 0x9249249);
}  // namespace detail

/// Of three coordinates' low 10 bits. Phase: any. Pure.
constexpr std::uint32_t morton_place(std::uint32_t x, std::uint32_t y, std::uint32_t z) {
  return detail::spread_bits(x) | detail::spread_bits(y) << 1 | detail::spread_bits(z) << 2;
}

}  // namespace tactus::label
