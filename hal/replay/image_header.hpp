// What an image file claims to be, read before any decoder may allocate for it.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "rt/status.hpp"

namespace tactus::hal::replay {

enum class ImageFormat : std::uint8_t { png, jpeg };

struct ImageHeader {
  ImageFormat format = ImageFormat::png;
  std::uint32_t width = 0, height = 0;
  int bits_per_channel = 0;  // of a palette: of its indices
  int channels = 0;          // 1 grey or palette, 2 grey + alpha, 3 colour, 4 colour + alpha
  bool has_palette = false;
};

/// Reads PNG's IHDR or JPEG's first frame header (SOF). Pure and allocation-free but for the error. The
/// error's message does not name the file: the caller puts it in front.
rt::Result<ImageHeader> parse_image_header(std::string_view bytes);

enum class ImageUse : std::uint8_t {
  depth,  // 16-bit greyscale PNG
  label,  // 8-bit greyscale PNG
  color,  // PNG or JPEG, 8 bits or less per channel
};

/// Empty when the image can serve, else what is wrong. A size of 0 x 0 accepts every size up to
/// kImageSideMax.
std::string fault_of(const ImageHeader& header, ImageUse use, int width, int height);

}  // namespace tactus::hal::replay
