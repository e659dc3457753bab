// Time as int64 nanoseconds in types that cannot be mixed: what the sensor's clock said is not what ours says.
#pragma once

#include <compare>
#include <cstdint>

namespace tactus::rt {

struct Duration {
  std::int64_t ns = 0;
  friend constexpr auto operator<=>(Duration, Duration) = default;
  constexpr Duration operator+(Duration other) const { return {ns + other.ns}; }
  constexpr Duration operator-(Duration other) const { return {ns - other.ns}; }
  [[nodiscard]] constexpr double seconds() const { return static_cast<double>(ns) * 1e-9; }
  [[nodiscard]] constexpr double milliseconds() const { return static_cast<double>(ns) * 1e-6; }
};

/// A point on the clock named by Tag; points of different clocks do not subtract.
template <typename Tag>
struct TimePoint {
  std::int64_t ns = 0;
  friend constexpr auto operator<=>(TimePoint, TimePoint) = default;
  constexpr Duration operator-(TimePoint other) const { return {ns - other.ns}; }
  constexpr TimePoint operator+(Duration d) const { return {ns + d.ns}; }
  constexpr TimePoint operator-(Duration d) const { return {ns - d.ns}; }
  [[nodiscard]] constexpr double seconds() const { return static_cast<double>(ns) * 1e-9; }
};

using SensorTime = TimePoint<struct SensorClockTag>;  ///< the device's clock, exposure midpoint where known
using HostTime = TimePoint<struct HostClockTag>;      ///< our monotonic clock, see rt/clock.hpp

inline namespace literals {
constexpr Duration operator""_ns(unsigned long long n) { return {static_cast<std::int64_t>(n)}; }
constexpr Duration operator""_us(unsigned long long n) { return {static_cast<std::int64_t>(n) * 1000}; }
constexpr Duration operator""_ms(unsigned long long n) { return {static_cast<std::int64_t>(n) * 1'000'000}; }
constexpr Duration operator""_s(unsigned long long n) { return {static_cast<std::int64_t>(n) * 1'000'000'000}; }
constexpr std::size_t operator""_KiB(unsigned long long n) { return static_cast<std::size_t>(n) << 10; }
constexpr std::size_t operator""_MiB(unsigned long long n) { return static_cast<std::size_t>(n) << 20; }
}  // namespace literals

}  // namespace tactus::rt
