// Images in files to pixels and back: libpng directly, JPEG by hal/frames. A decoder's warning must reject the
// frame, which imgcodecs cannot tell us.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

#include "hal/replay/image_header.hpp"
#include "rt/status.hpp"

namespace tactus::hal::replay {

/// Decode into caller's memory of exactly width * height values (times 3 for RGB). The size and kind of the
/// image are checked first, so nothing larger than the caller expects is ever decoded. Empty when it went
/// well, else what is wrong, without the file's name. On failure the pixels are unspecified. May allocate.
std::string decode_depth(std::string_view bytes, int width, int height, std::span<std::uint16_t> out);
std::string decode_label(std::string_view bytes, int width, int height, std::span<std::uint8_t> out);
std::string decode_color(std::string_view bytes, int width, int height, std::span<std::uint8_t> rgb);

/// Lossless PNG files; the depth values read back are the ones given. Error: the file cannot be written.
rt::Result<void> write_depth_png(const std::filesystem::path& path, std::span<const std::uint16_t> depth,
                                 int width, int height);
rt::Result<void> write_label_png(const std::filesystem::path& path, std::span<const std::uint8_t> ids,
                                 int width, int height);
rt::Result<void> write_color_png(const std::filesystem::path& path, std::span<const std::uint8_t> rgb,
                                 int width, int height);
/// Quality 1..100, chroma at full resolution.
rt::Result<void> write_color_jpeg(const std::filesystem::path& path, std::span<const std::uint8_t> rgb,
                                  int width, int height, int quality);

}  // namespace tactus::hal::replay
