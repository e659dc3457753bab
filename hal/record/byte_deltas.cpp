#include "hal/record/byte_deltas.hpp"

#include <algorithm>

#include "rt/assert.hpp"

namespace tactus::hal::record {
namespace {

void subtract(std::size_t step, std::span<const std::uint8_t> bytes, std::span<std::uint8_t> out) {
  std::copy_n(bytes.begin(), std::min(step, bytes.size()), out.begin());
  for (std::size_t i = step; i < bytes.size(); ++i) out[i] = static_cast<std::uint8_t>(bytes[i] - bytes[i - step]);
}

void add(std::size_t step, std::span<std::uint8_t> bytes) {
  for (std::size_t i = step; i < bytes.size(); ++i) bytes[i] = static_cast<std::uint8_t>(bytes[i] + bytes[i - step]);
}

}  // namespace

void to_deltas(PixelFormat format, std::size_t luma_bytes, std::span<const std::uint8_t> bytes,
               std::span<std::uint8_t> out) {
  TACTUS_ASSERT(out.size() == bytes.size());
  if (format == PixelFormat::rgb24) return subtract(3, bytes, out);
  if (format == PixelFormat::nv12) {
    luma_bytes = std::min(luma_bytes, bytes.size());
    subtract(1, bytes.first(luma_bytes), out.first(luma_bytes));
    return subtract(2, bytes.subspan(luma_bytes), out.subspan(luma_bytes));
  }
  TACTUS_ASSERT(format == PixelFormat::yuyv);
  std::copy_n(bytes.begin(), std::min<std::size_t>(4, bytes.size()), out.begin());
  for (std::size_t i = 4; i + 3 < bytes.size(); i += 4) {
    out[i] = static_cast<std::uint8_t>(bytes[i] - bytes[i - 2]);
    out[i + 1] = static_cast<std::uint8_t>(bytes[i + 1] - bytes[i - 3]);
    out[i + 2] = static_cast<std::uint8_t>(bytes[i + 2] - bytes[i]);
    out[i + 3] = static_cast<std::uint8_t>(bytes[i + 3] - bytes[i - 1]);
  }
}

void from_deltas(PixelFormat format, std::size_t luma_bytes, std::span<std::uint8_t> bytes) {
  if (format == PixelFormat::rgb24) return add(3, bytes);
  if (format == PixelFormat::nv12) {
    luma_bytes = std::min(luma_bytes, bytes.size());
    add(1, bytes.first(luma_bytes));
    return add(2, bytes.subspan(luma_bytes));
  }
  TACTUS_ASSERT(format == PixelFormat::yuyv);
  for (std::size_t i = 4; i + 3 < bytes.size(); i += 4) {
    bytes[i] = static_cast<std::uint8_t>(bytes[i] + bytes[i - 2]);
    bytes[i + 1] = static_cast<std::uint8_t>(bytes[i + 1] + bytes[i - 3]);
    bytes[i + 2] = static_cast<std::uint8_t>(bytes[i + 2] + bytes[i]);
    bytes[i + 3] = static_cast<std::uint8_t>(bytes[i + 3] + bytes[i - 1]);
  }
}

}  // namespace tactus::hal::record
