// Scaling a colour image to a network's input: separable triangle filter in fixed point, row by row.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "rt/slice.hpp"

namespace tactus::segment {

/// Source pixels that make one result pixel along one axis: `count` from `first` on, weights (of 2^14) from
/// `weight` on.
struct Tap {
  std::int32_t first = 0;
  std::int32_t count = 0;
  std::int32_t weight = 0;
};

/// Bilinear when enlarging; when reducing, the triangle widens with the ratio, so that nothing between the
/// samples is lost (as Pillow's BILINEAR does). Pixel centres at halves: result pixel i looks at (i + 1/2) *
/// ratio - 1/2. Integers only: the same bytes on every machine. Any sizes of 1..16384.
class ImageResizer {
 public:
  ImageResizer() = default;
  static std::size_t bytes_needed(int source_width, int source_height, int width, int height);
  ImageResizer(int source_width, int source_height, int width, int height, rt::Slice& memory);

  /// One row of the result (width * 3 bytes) from the whole source image (RGB8). Phase: step; thread-bound.
  void row(std::span<const std::uint8_t> source, int y, std::span<std::uint8_t> out) noexcept;

 private:
  int source_width_ = 0;
  std::span<Tap> columns_, rows_;
  std::span<std::uint16_t> column_weights_, row_weights_;
  std::span<std::uint32_t> sums_;     // one source row, summed vertically
  std::span<std::uint16_t> blended_;  // the same at 8.8 bits
};

}  // namespace tactus::segment
