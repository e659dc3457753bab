// The lossless filter of depth images before zstd: differences between neighbours, in steps of the camera's own.
//
// Cameras that measure disparity deliver few distinct values (a Kinect 100 to 430 per image, 2 mm apart near and 70 mm
// apart far), so neighbours on one wall differ by whole such steps, each of another size. A value is therefore replaced by
// its rank among those that occur in the image, and the rank is predicted by the mean of its left and upper neighbours;
// what remains is mostly -1, 0 or 1. Holes (0) are told as runs and take no part; in their place the last rank on the left
// is kept for those below. Where every value occurs (time of flight) ranks are the values less a constant: nothing is
// lost. tests/bench/depth_codec_bench.cpp has the figures beside RVL and LZ4.
//
//   uint32 count of distinct values but 0; each as its distance to the one before, from 0
//   lengths of runs, of holes and of values in turn, holes first, until the image is full
//   for each value, in order: rank - prediction modulo 2^16 as signed number, zigzag; below 255 one byte, else 255 and two
// Counts and lengths are LEB128: 7 bits a byte, low ones first.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace tactus::hal::record {

/// Most bytes that an image of so many pixels becomes.
constexpr std::size_t ranks_bytes_max(std::size_t pixels_count) { return 4 + (std::size_t{67} << 10) + 4 * pixels_count; }

/// Memory for both directions. One thread at a time; no heap after it is made.
class DepthRanks {
 public:
  DepthRanks(int width, int height);

  /// `depth` has width * height values, `out` ranks_bytes_max(). Answers the bytes written.
  std::size_t pack(std::span<const std::uint16_t> depth, std::span<std::uint8_t> out);

  /// False when the bytes are not such an image, with nothing left over: `depth` is then unspecified. Safe on any bytes.
  bool unpack(std::span<const std::uint8_t> packed, std::span<std::uint16_t> depth);

  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  std::size_t width_, height_;
  std::vector<std::uint16_t> table_;  // value to rank, or rank to value
  std::vector<std::uint16_t> above_;  // ranks of the row above
};

}  // namespace tactus::hal::record
