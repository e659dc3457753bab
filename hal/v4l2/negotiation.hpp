// Format, size and rate agreed with a driver, and set again on a device that comes back.
#pragma once

#include <linux/videodev2.h>

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "hal/v4l2/modes.hpp"
#include "hal/v4l2/node.hpp"
#include "rt/status.hpp"

namespace tactus::hal::v4l2 {

struct Agreement {
  v4l2_format format{};   // as the driver answered it
  PixelFormat pixel_format = PixelFormat::depth16;
  int width = 0, height = 0;     // pixels
  std::size_t row_bytes = 0;     // 0 for mjpeg
  std::size_t image_bytes = 0;   // the most that one frame takes
  Interval interval;             // 0/0: not set
  double frame_rate_hz = 30;     // as the driver answered; 30 when it does not say
  std::vector<std::string> notes;

  [[nodiscard]] bool is_multiplanar() const { return format.type == V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE; }
  [[nodiscard]] std::uint32_t fourcc() const;
};

/// Chooses among what the node offers, sets it and checks what the driver made of it. Boot.
rt::Result<Agreement> agree(int fd, const NodeInfo& info, const ModeWish& wish, std::string_view device);

/// Sets the same on a node just opened; false: it is not the same device after all. No heap.
bool restore(int fd, const Agreement& agreement) noexcept;

}  // namespace tactus::hal::v4l2
