// From what a device gave to what the pipeline takes, the same bits on every machine: live backends and recordings
// both go through here, so that a replay sees the pixels that the live run saw.
#pragma once

#include <cstdint>
#include <span>

#include "hal/raw_frame.hpp"
#include "rt/status.hpp"

namespace tactus::hal::frames {

/// Bytes of a frame without padding between its rows; 0 for mjpeg, where they vary.
std::size_t packed_bytes(PixelFormat format, int width, int height);

/// Whether `frame` holds the pixels that its size and row_bytes promise.
bool is_whole(const RawFrame& frame);

/// Copies the rows together; `depth` has width * height values. 65535, a saturated or invalid value in every unit, becomes
/// 0. ok | corrupt (not whole) | unsupported (not depth16). No heap. Any thread.
rt::Status to_depth(const RawFrame& frame, std::span<std::uint16_t> depth);

/// Converts to width * height * 3 bytes of RGB: BT.601 in 16-bit fixed point, chroma of a pixel pair or block taken as it
/// is. mjpeg is decoded by libjpeg, which allocates; the others touch no heap. ok | corrupt | unsupported (depth16). Any
/// thread.
rt::Status to_rgb(const RawFrame& frame, std::span<std::uint8_t> rgb);

/// What a source without a form of its own shows to a recorder: the pixels that it delivered.
RawFrame raw_frame(std::span<const std::uint16_t> depth, const FrameHeader& header, int width, int height);
RawFrame raw_frame(std::span<const std::uint8_t> rgb, const FrameHeader& header, int width, int height);

}  // namespace tactus::hal::frames
