// How a device's clock runs against this machine's, from when frames were taken and when they arrived.
//
// arrived - time is a line in time (offset and drift) plus a delay that is never negative: transfer, scheduling. So of each
// second only the shortest delay is kept, and the line is fitted through those of the last minute.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "rt/time.hpp"

namespace tactus {

class ClockFit {
 public:
  /// Step; one thread, in the order of time. At most 60 multiplications, once a second.
  void add(rt::SensorTime time, rt::HostTime arrived) noexcept;

  [[nodiscard]] bool is_known() const noexcept { return has_origin_; }
  /// How much faster the device's clock runs than ours, in millionths. Crystals stay below 100; nothing until three
  /// seconds were seen, and beyond 1000, where it is not the clocks: a device that falls behind, say.
  [[nodiscard]] std::optional<double> drift_ppm() const noexcept;

  /// When a frame taken at `time` arrives at the earliest; the inverse. Asserts is_known().
  [[nodiscard]] rt::HostTime host_of(rt::SensorTime time) const noexcept;
  [[nodiscard]] rt::SensorTime sensor_of(rt::HostTime arrived) const noexcept;

 private:
  static constexpr std::int64_t kWindowNs = 1'000'000'000;
  static constexpr std::size_t kWindowsMax = 60;
  static constexpr std::size_t kWindowsMin = 3;  // for a slope
  static constexpr double kSlopeMax = 1e-3;
  struct Point {
    double time_s = 0, delay_s = 0;  // from the origin, beyond the first delay
  };

  void close_window() noexcept;
  void fit() noexcept;
  [[nodiscard]] double seconds_from_origin(rt::SensorTime time) const noexcept;

  bool has_origin_ = false;
  std::int64_t origin_time_ns_ = 0, origin_delay_ns_ = 0;
  std::int64_t window_end_ns_ = 0;
  Point shortest_;  // of the open window
  std::array<Point, kWindowsMax> points_{};
  std::size_t points_count_ = 0, next_point_ = 0;
  double delay_s_ = 0, slope_ = 0;  // of the line: delay_s_ + slope_ * seconds_from_origin
};

}  // namespace tactus
