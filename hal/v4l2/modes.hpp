// What a device offers, and the choice among it: pure, so that recorded enumerations can test it.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "hal/live_camera.hpp"
#include "hal/raw_frame.hpp"
#include "rt/status.hpp"

namespace tactus::hal::v4l2 {

/// Seconds from frame to frame as V4L2 says it; 0/0: unknown.
struct Interval {
  std::uint32_t numerator = 0, denominator = 0;
  [[nodiscard]] double hz() const { return numerator == 0 ? 0 : static_cast<double>(denominator) / numerator; }
};

/// One dimension of a frame, pixels: discrete when min == max.
struct Extent {
  int min = 0, max = 0, step = 1;
  /// The value on its grid that is nearest to `wanted`.
  [[nodiscard]] int nearest(int wanted) const;
};

/// One size or range of sizes.
struct SizeOffer {
  Extent width, height;
  std::vector<Interval> intervals;     // of a range: some, at the size asked for; empty: the driver does not say
  bool is_interval_range = false;      // then `intervals` has the shortest and the longest, and all between are offered
};

struct FormatOffer {
  std::uint32_t fourcc = 0;
  std::vector<SizeOffer> sizes;
};

struct ModeWish {
  Stream stream = Stream::depth;
  std::string format;  // empty: any
  ModeRequest mode;    // 0: any
};

struct ModeChoice {
  std::uint32_t fourcc = 0;
  PixelFormat format = PixelFormat::depth16;
  int width = 0, height = 0;  // pixels
  Interval interval;          // 0/0: leave it to the driver
};

/// The format, size and rate for a wish. A rate is met within 1 %. What is not asked for: nearest to 640 x 480, nearest to
/// 30 Hz; the first format in readable_formats() of those that come nearest. Error: one sentence that begins with `device`
/// and says what there is instead.
rt::Result<ModeChoice> choose_mode(std::span<const FormatOffer> offers, const ModeWish& wish, std::string_view device);

/// "depth Z16 640x480 30, 15 Hz" for each readable size, and one line naming the formats that cannot be read.
std::vector<std::string> mode_lines(std::span<const FormatOffer> offers);

}  // namespace tactus::hal::v4l2
