#include "pipeline/capture/pairing.hpp"

#include <algorithm>

namespace tactus {

void Pairing::configure(double frame_rate_hz, bool has_two_clocks) noexcept {
  has_two_clocks_ = has_two_clocks;
  early_max_ = std::min(kSkewMax, rt::Duration{static_cast<std::int64_t>(0.5e9 / frame_rate_hz)});
}

void Pairing::saw_depth(const hal::FrameHeader& depth) noexcept {
  if (depth.arrived.ns != 0) depth_clock_.add(depth.time, depth.arrived);
}

void Pairing::saw_color(const hal::FrameHeader& color) noexcept {
  if (color.arrived.ns != 0) color_clock_.add(color.time, color.arrived);
}

rt::Duration Pairing::skew(const hal::FrameHeader& depth, const hal::FrameHeader& color) const noexcept {
  if (!has_two_clocks_ || !depth_clock_.is_known() || !color_clock_.is_known()) return color.time - depth.time;
  return depth_clock_.sensor_of(color_clock_.host_of(color.time)) - depth.time;
}

Match Pairing::match(const hal::FrameHeader& depth, const hal::FrameHeader& color) const noexcept {
  const rt::Duration distance = skew(depth, color);
  if (distance.ns < -early_max_.ns) return Match::early;
  return distance > kSkewMax ? Match::late : Match::partner;
}

void Pairing::count_pair(const hal::FrameHeader& depth, const hal::FrameHeader& color) noexcept {
  const std::int64_t ns = skew(depth, color).ns;
  constexpr std::int64_t kMillisecond = 1'000'000, kHalf = kSkewBins / 2;
  const std::int64_t rounded = (ns + (ns < 0 ? -kMillisecond / 2 : kMillisecond / 2)) / kMillisecond;
  ++skew_ms_counts_[static_cast<std::size_t>(std::clamp(rounded, -kHalf, kHalf) + kHalf)];
  distance_.record({ns < 0 ? -ns : ns});
}

}  // namespace tactus
