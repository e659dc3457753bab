// JPEG through libjpeg-turbo directly: a decoder's warning (a short or damaged image that it would fill up with grey)
// must reject the frame, which imgcodecs cannot tell us. Both directions use the integer transform: the same bits with
// and without SIMD.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "rt/status.hpp"

namespace tactus::hal::frames {

/// Bytes between the last block and the end mark: in a file they are damage, webcams send them with every frame.
enum class StrayBytes : std::uint8_t { refused, ignored };

/// Decodes into exactly width * height * 3 bytes; an image of another size is refused before its pixels are decoded. Empty
/// when it went well, else what is wrong. On failure the pixels are unspecified. Allocates.
std::string decode_jpeg(std::string_view bytes, int width, int height, std::span<std::uint8_t> rgb,
                        StrayBytes stray = StrayBytes::refused);

/// Quality 1..100, chroma at full resolution. False: the encoder failed. Allocates.
bool encode_jpeg(std::span<const std::uint8_t> rgb, int width, int height, int quality, std::vector<std::uint8_t>& bytes);

}  // namespace tactus::hal::frames
