// Which colour frame belongs to a depth frame: by the sensor's time, never further apart than kSkewMax, never twice.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "hal/camera.hpp"
#include "pipeline/capture/clock_fit.hpp"
#include "rt/histogram.hpp"
#include "rt/time.hpp"

namespace tactus {

enum class Match : std::uint8_t { early, partner, late };

class Pairing {
 public:
  static constexpr rt::Duration kSkewMax{20'000'000};  // as TUM pairs; more than half a frame at 30 Hz
  static constexpr std::size_t kSkewBins = 41;         // whole milliseconds, -20 to 20

  /// Boot. Two clocks: colour's times are brought to depth's by when frames arrived.
  void configure(double frame_rate_hz, bool has_two_clocks) noexcept;

  /// Each frame once, in its stream's order: learns how the clocks run.
  void saw_depth(const hal::FrameHeader& depth) noexcept;
  void saw_color(const hal::FrameHeader& color) noexcept;

  /// early: no depth frame from this one on is its partner, a nearer colour frame comes next. late: it may be the next
  /// depth frame's. Colour earlier by more than half an interval is early, so that each depth frame gets the nearest.
  [[nodiscard]] Match match(const hal::FrameHeader& depth, const hal::FrameHeader& color) const noexcept;

  /// What became of it.
  void count_pair(const hal::FrameHeader& depth, const hal::FrameHeader& color) noexcept;
  void count_color_alone() noexcept { ++colors_unpaired_; }
  void count_depth_alone() noexcept { ++depths_unpaired_; }

  [[nodiscard]] std::uint64_t paired() const noexcept { return distance_.count(); }
  [[nodiscard]] std::uint64_t colors_unpaired() const noexcept { return colors_unpaired_; }
  [[nodiscard]] std::uint64_t depths_unpaired() const noexcept { return depths_unpaired_; }
  /// Of the pairs: colour's time less depth's, in whole milliseconds from -20 on; its size.
  [[nodiscard]] const std::array<std::uint64_t, kSkewBins>& skew_ms_counts() const noexcept { return skew_ms_counts_; }
  [[nodiscard]] const rt::Histogram& distance() const noexcept { return distance_; }
  [[nodiscard]] const ClockFit& depth_clock() const noexcept { return depth_clock_; }
  [[nodiscard]] const ClockFit& color_clock() const noexcept { return color_clock_; }

 private:
  [[nodiscard]] rt::Duration skew(const hal::FrameHeader& depth, const hal::FrameHeader& color) const noexcept;

  bool has_two_clocks_ = false;
  rt::Duration early_max_ = kSkewMax;
  ClockFit depth_clock_, color_clock_;
  std::uint64_t colors_unpaired_ = 0, depths_unpaired_ = 0;
  std::array<std::uint64_t, kSkewBins> skew_ms_counts_{};
  rt::Histogram distance_;
};

}  // namespace tactus
