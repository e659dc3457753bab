// The lossless filter of uncompressed colour before zstd: each byte less the same component of the pixel before it.
#pragma once

#include <cstdint>
#include <span>

#include "hal/raw_frame.hpp"

namespace tactus::hal::record {

/// rgb24, yuyv or nv12 (its luma plane of `luma_bytes`, then its pairs of U and V) without padding between rows. `out` is
/// as long as `bytes` and may not overlap it.
void to_deltas(PixelFormat format, std::size_t luma_bytes, std::span<const std::uint8_t> bytes,
               std::span<std::uint8_t> out);
/// Back, in place.
void from_deltas(PixelFormat format, std::size_t luma_bytes, std::span<std::uint8_t> bytes);

}  // namespace tactus::hal::record
