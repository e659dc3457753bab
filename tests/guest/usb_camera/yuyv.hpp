// From RGB to what a USB camera sends; the other way is hal::frames::to_rgb.
#pragma once

#include <cstdint>
#include <span>

namespace tactus::guest {

/// BT.601, limited range, in 16-bit fixed point: the same bytes on every machine. The chroma of a pair is that of its mean.
/// `rgb` has 3, `yuyv` 2 bytes a pixel, and the pixels are whole pairs.
void to_yuyv(std::span<const std::uint8_t> rgb, std::span<std::uint8_t> yuyv);

}  // namespace tactus::guest
