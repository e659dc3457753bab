#include "pipeline/capture/clock_fit.hpp"

#include <algorithm>

#include "rt/assert.hpp"

namespace tactus {

double ClockFit::seconds_from_origin(rt::SensorTime time) const noexcept {
  return static_cast<double>(time.ns - origin_time_ns_) * 1e-9;
}

void ClockFit::add(rt::SensorTime time, rt::HostTime arrived) noexcept {
  const std::int64_t delay_ns = arrived.ns - time.ns;
  if (!has_origin_) {
    has_origin_ = true;
    origin_time_ns_ = time.ns;
    origin_delay_ns_ = delay_ns;
    window_end_ns_ = time.ns + kWindowNs;
    return;
  }
  if (time.ns >= window_end_ns_) {
    close_window();
    window_end_ns_ = time.ns + kWindowNs;
    shortest_ = {seconds_from_origin(time), static_cast<double>(delay_ns - origin_delay_ns_) * 1e-9};
    return;
  }
  const Point point{seconds_from_origin(time), static_cast<double>(delay_ns - origin_delay_ns_) * 1e-9};
  if (point.delay_s < shortest_.delay_s) shortest_ = point;
  // Until the first line there is only the shortest delay so far.
  if (points_count_ == 0) delay_s_ = shortest_.delay_s;
}

void ClockFit::close_window() noexcept {
  points_[next_point_] = shortest_;
  next_point_ = (next_point_ + 1) % kWindowsMax;
  points_count_ = std::min(points_count_ + 1, kWindowsMax);
  fit();
}

void ClockFit::fit() noexcept {
  double mean_time = 0, mean_delay = 0;
  for (std::size_t i = 0; i < points_count_; ++i) {
    mean_time += points_[i].time_s;
    mean_delay += points_[i].delay_s;
  }
  const auto n = static_cast<double>(points_count_);
  mean_time /= n;
  mean_delay /= n;
  double covariance = 0, variance = 0;
  for (std::size_t i = 0; i < points_count_; ++i) {
    const double t = points_[i].time_s - mean_time;
    covariance += t * (points_[i].delay_s - mean_delay);
    variance += t * t;
  }
  slope_ = points_count_ >= kWindowsMin && variance > 0 ? std::clamp(covariance / variance, -kSlopeMax, kSlopeMax) : 0;
  delay_s_ = mean_delay - slope_ * mean_time;
}

std::optional<double> ClockFit::drift_ppm() const noexcept {
  if (points_count_ < kWindowsMin || slope_ <= -kSlopeMax || slope_ >= kSlopeMax) return std::nullopt;
  return -slope_ / (1 + slope_) * 1e6;
}

rt::HostTime ClockFit::host_of(rt::SensorTime time) const noexcept {
  TACTUS_ASSERT(has_origin_);
  const double delay_s = delay_s_ + slope_ * seconds_from_origin(time);
  return {time.ns + origin_delay_ns_ + static_cast<std::int64_t>(delay_s * 1e9)};
}

rt::SensorTime ClockFit::sensor_of(rt::HostTime arrived) const noexcept {
  TACTUS_ASSERT(has_origin_);
  // arrived = time + origin_delay + delay_s + slope * (time - origin)
  const double from_origin_s =
      (static_cast<double>(arrived.ns - origin_delay_ns_ - origin_time_ns_) * 1e-9 - delay_s_) / (1 + slope_);
  return {origin_time_ns_ + static_cast<std::int64_t>(from_origin_s * 1e9)};
}

}  // namespace tactus
