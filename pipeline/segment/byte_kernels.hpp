// The 8-bit operators that XNNPACK lacks or rounds differently from one processor to the next: integers only,
// exact.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "pipeline/segment/tflite_model.hpp"

namespace tactus::segment {

/// result = table[byte]; bytes are the two's complement pattern, whatever the element type.
using ByteTable = std::array<std::uint8_t, 256>;

/// The value an 8-bit element stands for, less its zero point.
struct ByteFormat {
  ElementType type = ElementType::int8;  // int8 or uint8
  float scale = 1;
  std::int32_t zero_point = 0;
};

/// A multiplier in (0, 2^31) as a 31-bit fraction and a power of two: real = fraction * 2^(shift - 31).
struct FixedMultiplier {
  std::int32_t fraction = 0;
  std::int32_t shift = 0;
};
FixedMultiplier fixed_multiplier(double real);

/// x * multiplier, rounded as the reference interpreter of the format does it: to nearest, twice (gemmlowp: a
/// doubling high product that rounds half away from zero, then a shift that does too).
std::int32_t multiply(std::int32_t x, FixedMultiplier multiplier);

/// QUANTIZE, RELU, RELU6: the same real value in another scale, zero point and type, limited to [low, high]
/// (quantised).
ByteTable requantize_table(const ByteFormat& from, const ByteFormat& to, std::int32_t low, std::int32_t high);
/// LOGISTIC: 1 / (1 + exp(-x)).
ByteTable logistic_table(const ByteFormat& from, const ByteFormat& to);
/// HARD_SWISH: x * min(max(x + 3, 0), 6) / 6.
ByteTable hard_swish_table(const ByteFormat& from, const ByteFormat& to);

/// Pixels of `channels` bytes each, `stride` bytes apart.
struct Pixels {
  std::uint8_t* first = nullptr;
  std::size_t stride = 0;
};

/// Any of these: phase step, thread-safe, no allocation, bounded by the number of elements.
void map_bytes(const ByteTable& table, Pixels input, Pixels output, std::size_t pixels_count,
               std::size_t channels) noexcept;
void copy_pixels(Pixels input, Pixels output, std::size_t pixels_count, std::size_t bytes_per_pixel) noexcept;

struct PoolGeometry {
  Shape input, output;
  std::int32_t window_h = 1, window_w = 1, stride_h = 1, stride_w = 1;
  Margins margins;
};

/// Mean over the part of the window inside the image, rounded half away from zero, then mapped by
/// `multiplier` around the zero points (fraction 0: input and output agree, as AVERAGE_POOL_2D demands),
/// limited to [low, high].
struct AveragePool {
  PoolGeometry geometry;
  bool is_signed = true;
  bool is_mean = false;        // MEAN: sum of (q - zero) * multiplier, one rounding
  FixedMultiplier multiplier;  // only with is_mean: scale_in / (scale_out * window)
  std::int32_t input_zero = 0, output_zero = 0;
  std::int32_t low = -128, high = 127;
};
void average_pool(const AveragePool& pool, Pixels input, Pixels output) noexcept;

/// Copies an image into a larger one and fills the margins with copies of `fill` (bytes_per_element of them).
void pad(const Shape& input_shape, const Shape& output_shape, Margins margins,
         std::span<const std::uint8_t> fill, Pixels input, Pixels output) noexcept;

}  // namespace tactus::segment
