// Numbers to and from the bytes of a recording.
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <type_traits>

namespace tactus::hal::record {

static_assert(std::endian::native == std::endian::little, "recordings are little-endian, and copied as they are");

/// Writes `value` at `at`; answers where the next goes.
template <typename Number>
std::uint8_t* put(std::uint8_t* at, Number value) {
  static_assert(std::is_arithmetic_v<Number>);
  std::memcpy(at, &value, sizeof value);
  return at + sizeof value;
}

/// Reads what is at `at` and moves on.
template <typename Number>
Number take(const std::uint8_t*& at) {
  static_assert(std::is_arithmetic_v<Number>);
  Number value{};
  std::memcpy(&value, at, sizeof value);
  at += sizeof value;
  return value;
}

}  // namespace tactus::hal::record
