// Which of a camera's formats is taken: those that frames::to_rgb converts and a recorder can keep.
#pragma once

#include <libcamera/libcamera.h>

#include <optional>
#include <string>
#include <vector>

#include "hal/live_camera.hpp"
#include "hal/raw_frame.hpp"
#include "rt/status.hpp"

namespace tactus::hal::libcamera {

namespace lc = ::libcamera;

/// What RawFrame calls this format; nothing when it has no name there. libcamera names the bytes of a pixel as one
/// little-endian word: its BGR888 is R, G, B in memory.
std::optional<PixelFormat> raw_format(const lc::PixelFormat& format);

struct FormatChoice {
  lc::PixelFormat theirs;
  PixelFormat ours = PixelFormat::rgb24;
  lc::Size size;
};

/// The size and the format that LibcameraRequest describes. bad_usage: the camera has them not; the sentence lists what it
/// has.
rt::Result<FormatChoice> choose_format(const lc::StreamFormats& offered, const ModeRequest& mode,
                                       const std::string& format);

/// "color YUYV 640x480", one line for each format that can be taken and each of its sizes; others are one line each.
std::vector<std::string> describe(const lc::StreamFormats& offered);

}  // namespace tactus::hal::libcamera
