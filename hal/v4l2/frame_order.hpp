// Numbers and times of a live stream, made of what the driver says: rising through wraps, restarts and re-plugging. Pure.
#pragma once

#include <cstdint>
#include <optional>

#include "rt/time.hpp"

namespace tactus::hal::v4l2 {

/// Thread-bound. No heap.
class FrameOrder {
 public:
  struct Number {
    std::uint64_t sequence = 0;
    std::uint64_t missing_count = 0;  // numbers left out just before it
  };

  /// The number of the frame that the driver numbers `driver_sequence`. A driver that does not count (always the same
  /// number), or counts anew, goes on by one.
  Number next(std::uint32_t driver_sequence) {
    std::uint32_t ahead = 1;
    if (has_number_ && !is_restarted_) {
      ahead = driver_sequence - driver_sequence_;
      constexpr std::uint32_t kBackwards = 1U << 31;
      if (ahead == 0 || ahead >= kBackwards) ahead = 1;
    }
    sequence_ = has_number_ ? sequence_ + ahead : driver_sequence;
    driver_sequence_ = driver_sequence;
    has_number_ = true;
    is_restarted_ = false;
    return {sequence_, ahead - 1};
  }

  /// The driver's number may start anew: the next frame follows the last, whatever it says; how many were lost meanwhile,
  /// nobody knows.
  void restart() { is_restarted_ = true; }

 private:
  std::uint64_t sequence_ = 0;
  std::uint32_t driver_sequence_ = 0;
  bool has_number_ = false, is_restarted_ = false;
};

/// Nanoseconds of a kernel stamp; nothing when it is not a time: negative, or beyond 292 years.
inline std::optional<std::int64_t> stamp_ns(std::int64_t seconds, std::int64_t microseconds) {
  constexpr std::int64_t kSecondsMax = 9'223'372'035;
  if (seconds < 0 || seconds > kSecondsMax || microseconds < 0 || microseconds >= 1'000'000) return std::nullopt;
  return seconds * 1'000'000'000 + microseconds * 1000;
}

/// The device's clock over restarts. On the host's clock nothing has to be done; one of the device's own may start at 0
/// when it comes back, and is moved so that the time away is what the host saw. Thread-bound. No heap.
class DeviceClock {
 public:
  rt::SensorTime at(std::int64_t device_ns, rt::HostTime arrived, bool is_host_clock) {
    if (is_restarted_ && has_time_ && !is_host_clock)
      offset_ns_ = last_.ns + (arrived.ns - last_arrived_.ns) - device_ns;
    is_restarted_ = false;
    has_time_ = true;
    last_ = {device_ns + offset_ns_};
    last_arrived_ = arrived;
    return last_;
  }
  void restart() { is_restarted_ = true; }

 private:
  rt::SensorTime last_;
  rt::HostTime last_arrived_;
  std::int64_t offset_ns_ = 0;
  bool has_time_ = false, is_restarted_ = false;
};

}  // namespace tactus::hal::v4l2
