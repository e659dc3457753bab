// Other ways to make a depth image smaller, for the comparison.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace tactus::bench {

/// RVL (Wilson 2017, "Fast Lossless Depth Image Compression"): runs of zeros and of values, differences to the value
/// before, zigzag, 3 bits and a flag per nibble. Written after the paper's listing.
void rvl_encode(std::span<const std::uint16_t> depth, std::vector<std::uint8_t>& out);
/// False when the bytes end early or hold more than the image.
bool rvl_decode(std::span<const std::uint8_t> bytes, std::span<std::uint16_t> depth);

/// The usual filter before a byte codec: JPEG-LS' median prediction of the value, zigzag, low bytes then high bytes.
void median_planes(std::span<const std::uint16_t> depth, int width, std::vector<std::uint8_t>& out);
void from_median_planes(std::span<const std::uint8_t> planes, int width, std::span<std::uint16_t> depth);

}  // namespace tactus::bench
