#include "pipeline/segment/byte_kernels.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "pipeline/segment/exponential.hpp"

namespace tactus::segment {
namespace {

std::int32_t value_of(std::uint8_t byte, ElementType type) {
  return type == ElementType::int8 ? static_cast<std::int8_t>(byte) : static_cast<std::int32_t>(byte);
}
std::int32_t lowest(ElementType type) { return type == ElementType::int8 ? -128 : 0; }
std::int32_t highest(ElementType type) { return type == ElementType::int8 ? 127 : 255; }

/// floor(x + 1/2): one rule for every processor, unlike the rounding mode.
std::int32_t rounded(double x) { return static_cast<std::int32_t>(std::floor(x + 0.5)); }

template <typename Function>
ByteTable tabulate(const ByteFormat& from, const ByteFormat& to, const Function& function) {
  ByteTable table{};
  for (int byte = 0; byte < 256; ++byte) {
    const std::int32_t q = value_of(static_cast<std::uint8_t>(byte), from.type) - from.zero_point;
    const double real = function(static_cast<double>(q) * static_cast<double>(from.scale));
    const double scaled = std::clamp(real / static_cast<double>(to.scale), -1e6, 1e6);
    const std::int32_t result =
        std::clamp(rounded(scaled) + to.zero_point, lowest(to.type), highest(to.type));
    table[static_cast<std::size_t>(byte)] = static_cast<std::uint8_t>(result);
  }
  return table;
}

}  // namespace

FixedMultiplier fixed_multiplier(double real) {
  TACTUS_ASSERT(real > 0);
  FixedMultiplier out;
  int exponent = 0;
  const double fraction = std::frexp(real, &exponent);  // exact
  auto scaled = static_cast<std::int64_t>(std::floor(fraction * 2147483648.0 + 0.5));
  if (scaled == std::int64_t{1} << 31) {
    scaled /= 2;
    ++exponent;
  }
  if (exponent < -31) return {0, 0};  // below one half for every 32-bit x
  out.fraction = static_cast<std::int32_t>(scaled);
  out.shift = std::min(exponent, 30);
  return out;
}

std::int32_t multiply(std::int32_t x, FixedMultiplier multiplier) {
  const int left = std::max(multiplier.shift, 0), right = std::max(-multiplier.shift, 0);
  const std::int64_t wide = static_cast<std::int64_t>(x) * (std::int64_t{1} << left);
  const std::int64_t shifted = std::clamp<std::int64_t>(wide, INT32_MIN, INT32_MAX);
  const std::int64_t product = shifted * multiplier.fraction;
  const std::int64_t nudge = product >= 0 ? (std::int64_t{1} << 30) : 1 - (std::int64_t{1} << 30);
  const auto high = static_cast<std::int32_t>((product + nudge) / (std::int64_t{1} << 31));
  const std::int32_t mask = static_cast<std::int32_t>((std::int64_t{1} << right) - 1);
  const std::int32_t threshold = (mask >> 1) + (high < 0 ? 1 : 0);
  return (high >> right) + ((high & mask) > threshold ? 1 : 0);
}

ByteTable requantize_table(const ByteFormat& from, const ByteFormat& to, std::int32_t low,
                           std::int32_t high) {
  const FixedMultiplier multiplier =
      fixed_multiplier(static_cast<double>(from.scale) / static_cast<double>(to.scale));
  ByteTable table{};
  for (int byte = 0; byte < 256; ++byte) {
    const std::int32_t q = value_of(static_cast<std::uint8_t>(byte), from.type) - from.zero_point;
    const std::int64_t result = static_cast<std::int64_t>(multiply(q, multiplier)) + to.zero_point;
    table[static_cast<std::size_t>(byte)] =
        static_cast<std::uint8_t>(std::clamp<std::int64_t>(result, low, high));
  }
  return table;
}

ByteTable logistic_table(const ByteFormat& from, const ByteFormat& to) {
  return tabulate(from, to, [](double x) {
    const double e = static_cast<double>(exponential(static_cast<float>(x < 0 ? x : -x)));
    return x < 0 ? e / (1 + e) : 1 / (1 + e);
  });
}

ByteTable hard_swish_table(const ByteFormat& from, const ByteFormat& to) {
  return tabulate(from, to, [](double x) { return x * std::clamp(x + 3, 0.0, 6.0) / 6; });
}

void map_bytes(const ByteTable& table, Pixels input, Pixels output, std::size_t pixels_count,
               std::size_t channels) noexcept {
  if (input.stride == channels && output.stride == channels) {
    channels *= pixels_count;
    pixels_count = 1;
  }
  for (std::size_t p = 0; p < pixels_count; ++p) {
    const std::uint8_t* in = input.first + p * input.stride;
    std::uint8_t* out = output.first + p * output.stride;
    for (std::size_t c = 0; c < channels; ++c) out[c] = table[in[c]];
  }
}

void copy_pixels(Pixels input, Pixels output, std::size_t pixels_count,
                 std::size_t bytes_per_pixel) noexcept {
  for (std::size_t p = 0; p < pixels_count; ++p)
    std::memcpy(output.first + p * output.stride, input.first + p * input.stride, bytes_per_pixel);
}

void average_pool(const AveragePool& pool, Pixels input, Pixels output) noexcept {
  const PoolGeometry& g = pool.geometry;
  const ElementType type = pool.is_signed ? ElementType::int8 : ElementType::uint8;
  const auto channels = static_cast<std::size_t>(g.input.channels());
  constexpr std::size_t kRun = 64;  // channels summed together: 64 sums stay in registers and level-1 cache
  for (std::int32_t y = 0; y < g.output.height(); ++y) {
    const std::int32_t y0 = y * g.stride_h - g.margins.top;
    const std::int32_t top = std::max(y0, 0), bottom = std::min(y0 + g.window_h, g.input.height());
    for (std::int32_t x = 0; x < g.output.width(); ++x) {
      const std::int32_t x0 = x * g.stride_w - g.margins.left;
      const std::int32_t left = std::max(x0, 0), right = std::min(x0 + g.window_w, g.input.width());
      const std::int32_t count = (bottom - top) * (right - left);
      std::uint8_t* out = output.first + static_cast<std::size_t>(y * g.output.width() + x) * output.stride;
      for (std::size_t c0 = 0; c0 < channels; c0 += kRun) {
        const std::size_t run = std::min(kRun, channels - c0);
        std::array<std::int32_t, kRun> sums{};
        for (std::int32_t yy = top; yy < bottom; ++yy)
          for (std::int32_t xx = left; xx < right; ++xx) {
            const std::uint8_t* in =
                input.first + static_cast<std::size_t>(yy * g.input.width() + xx) * input.stride + c0;
            for (std::size_t c = 0; c < run; ++c) sums[c] += value_of(in[c], type);
          }
        for (std::size_t c = 0; c < run; ++c) {
          std::int32_t mean = 0;
          if (pool.is_mean)
            mean = multiply(sums[c] - count * pool.input_zero, pool.multiplier) + pool.output_zero;
          else
            mean = (sums[c] > 0 ? sums[c] + count / 2 : sums[c] - count / 2) / count;
          out[c0 + c] = static_cast<std::uint8_t>(std::clamp(mean, pool.low, pool.high));
        }
      }
    }
  }
}

void pad(const Shape& input_shape, const Shape& output_shape, Margins margins,
         std::span<const std::uint8_t> fill, Pixels input, Pixels output) noexcept {
  const auto width = static_cast<std::size_t>(output_shape.width());
  const std::size_t bytes_per_pixel = static_cast<std::size_t>(input_shape.channels()) * fill.size();
  for (std::int32_t y = 0; y < output_shape.height(); ++y)
    for (std::int32_t x = 0; x < output_shape.width(); ++x) {
      std::uint8_t* out =
          output.first + (static_cast<std::size_t>(y) * width + static_cast<std::size_t>(x)) * output.stride;
      const std::int32_t yy = y - margins.top, xx = x - margins.left;
      if (yy >= 0 && yy < input_shape.height() && xx >= 0 && xx < input_shape.width()) {
        const std::size_t from =
            static_cast<std::size_t>(yy) * static_cast<std::size_t>(input_shape.width()) +
            static_cast<std::size_t>(xx);
        std::memcpy(out, input.first + from * input.stride, bytes_per_pixel);
      } else {
        for (std::size_t i = 0; i < bytes_per_pixel; ++i) out[i] = fill[i % fill.size()];
      }
    }
}

}  // namespace tactus::segment
