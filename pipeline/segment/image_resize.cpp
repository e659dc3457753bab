#include "pipeline/segment/image_resize.hpp"

#include <algorithm>
#include <cmath>

namespace tactus::segment {
namespace {

constexpr std::int32_t kOne = 1 << 14;

std::size_t taps_max(int source, int length) {
  const double ratio = static_cast<double>(source) / static_cast<double>(length);
  return static_cast<std::size_t>(2.0 * std::max(ratio, 1.0)) + 3;
}

void fill_taps(int source, int length, std::span<Tap> taps, std::span<std::uint16_t> weights) {
  const double ratio = static_cast<double>(source) / static_cast<double>(length);
  const double reach = std::max(ratio, 1.0);
  std::int32_t used = 0;
  for (int i = 0; i < length; ++i) {
    const double center = (static_cast<double>(i) + 0.5) * ratio - 0.5;
    const int first = std::max(static_cast<int>(std::floor(center - reach)), 0);
    const int last = std::min(static_cast<int>(std::floor(center + reach)) + 1, source - 1);
    double total = 0;
    for (int s = first; s <= last; ++s)
      total += std::max(0.0, 1.0 - std::abs(static_cast<double>(s) - center) / reach);
    Tap& tap = taps[static_cast<std::size_t>(i)];
    tap = {first, 0, used};
    std::int32_t sum = 0, largest = used;
    for (int s = first; s <= last; ++s) {
      const double weight = std::max(0.0, 1.0 - std::abs(static_cast<double>(s) - center) / reach) / total;
      const auto fixed = static_cast<std::int32_t>(std::floor(weight * kOne + 0.5));
      if (fixed == 0 && tap.count == 0) {
        tap.first = s + 1;  // leading zeros cost time
        continue;
      }
      weights[static_cast<std::size_t>(used + tap.count)] = static_cast<std::uint16_t>(fixed);
      if (fixed > weights[static_cast<std::size_t>(largest)]) largest = used + tap.count;
      sum += fixed;
      ++tap.count;
    }
    // The weights of a grey image must give that grey: what rounding lost or won goes to the largest.
    std::uint16_t& top = weights[static_cast<std::size_t>(largest)];
    top = static_cast<std::uint16_t>(static_cast<std::int32_t>(top) + kOne - sum);
    while (tap.count > 1 && weights[static_cast<std::size_t>(used + tap.count - 1)] == 0) --tap.count;
    used += tap.count;
  }
}

}  // namespace

std::size_t ImageResizer::bytes_needed(int source_width, int source_height, int width, int height) {
  const auto w = static_cast<std::size_t>(width), h = static_cast<std::size_t>(height);
  const std::size_t row_values = static_cast<std::size_t>(source_width) * 3;
  return rt::bytes_of<Tap>(w) + rt::bytes_of<Tap>(h) +
         rt::bytes_of<std::uint16_t>(w * taps_max(source_width, width)) +
         rt::bytes_of<std::uint16_t>(h * taps_max(source_height, height)) +
         rt::bytes_of<std::uint32_t>(row_values) + rt::bytes_of<std::uint16_t>(row_values);
}

ImageResizer::ImageResizer(int source_width, int source_height, int width, int height, rt::Slice& memory)
    : source_width_(source_width) {
  TACTUS_ASSERT(source_width >= 1 && source_height >= 1 && width >= 1 && height >= 1);
  TACTUS_ASSERT(source_width <= 16384 && source_height <= 16384 && width <= 16384 && height <= 16384);
  const auto w = static_cast<std::size_t>(width), h = static_cast<std::size_t>(height);
  columns_ = memory.take<Tap>(w);
  rows_ = memory.take<Tap>(h);
  column_weights_ = memory.take<std::uint16_t>(w * taps_max(source_width, width));
  row_weights_ = memory.take<std::uint16_t>(h * taps_max(source_height, height));
  sums_ = memory.take<std::uint32_t>(static_cast<std::size_t>(source_width) * 3);
  blended_ = memory.take<std::uint16_t>(static_cast<std::size_t>(source_width) * 3);
  fill_taps(source_width, width, columns_, column_weights_);
  fill_taps(source_height, height, rows_, row_weights_);
}

void ImageResizer::row(std::span<const std::uint8_t> source, int y, std::span<std::uint8_t> out) noexcept {
  const std::size_t row_values = static_cast<std::size_t>(source_width_) * 3;
  const Tap& vertical = rows_[static_cast<std::size_t>(y)];
  std::uint32_t* const sums = sums_.data();
  for (std::int32_t k = 0; k < vertical.count; ++k) {
    const std::uint32_t weight = row_weights_[static_cast<std::size_t>(vertical.weight + k)];
    const std::uint8_t* in = source.data() + static_cast<std::size_t>(vertical.first + k) * row_values;
    if (k == 0)
      for (std::size_t i = 0; i < row_values; ++i) sums[i] = weight * in[i];
    else
      for (std::size_t i = 0; i < row_values; ++i) sums[i] += weight * in[i];
  }
  // 255 * 2^14 to 255 * 2^8: fits 16 bits, and the second product 32.
  std::uint16_t* const blended = blended_.data();
  for (std::size_t i = 0; i < row_values; ++i) blended[i] = static_cast<std::uint16_t>((sums[i] + 32) >> 6);
  for (std::size_t x = 0; x < columns_.size(); ++x) {
    const Tap& tap = columns_[x];
    const std::uint16_t* weights = column_weights_.data() + tap.weight;
    const std::uint16_t* in = blended + static_cast<std::size_t>(tap.first) * 3;
    std::uint32_t r = 1U << 21, g = 1U << 21, b = 1U << 21;
    for (std::int32_t k = 0; k < tap.count; ++k, in += 3) {
      r += static_cast<std::uint32_t>(weights[k]) * in[0];
      g += static_cast<std::uint32_t>(weights[k]) * in[1];
      b += static_cast<std::uint32_t>(weights[k]) * in[2];
    }
    out[x * 3] = static_cast<std::uint8_t>(r >> 22);
    out[x * 3 + 1] = static_cast<std::uint8_t>(g >> 22);
    out[x * 3 + 2] = static_cast<std::uint8_t>(b >> 22);
  }
}

}  // namespace tactus::segment
