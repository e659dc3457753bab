// Names of V4L2 pixel formats, and which of them can be converted.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "hal/raw_frame.hpp"

namespace tactus::hal::v4l2 {

struct ReadableFormat {
  std::uint32_t fourcc;
  PixelFormat format;
};

/// What can be converted to a depth or colour image, best first: depth that says so before grey levels that are depth by
/// agreement, colour without loss before JPEG.
std::span<const ReadableFormat> readable_formats(Stream stream);

/// "Z16", "YUYV"; without blanks at its end, big-endian formats with "-BE".
std::string fourcc_text(std::uint32_t fourcc);

/// The inverse, in upper or lower case; also "MJPEG". Nothing: not one to four printable characters.
std::optional<std::uint32_t> parse_fourcc(std::string_view text);

}  // namespace tactus::hal::v4l2
