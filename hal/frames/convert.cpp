#include "hal/frames/convert.hpp"

#include <algorithm>
#include <cstring>

#include "hal/frames/jpeg_codec.hpp"
#include "rt/assert.hpp"

namespace tactus::hal::frames {
namespace {

std::size_t row_bytes_min(PixelFormat format, int width) {
  const auto w = static_cast<std::size_t>(width);
  switch (format) {
    case PixelFormat::depth16:
    case PixelFormat::yuyv:
      return 2 * w;
    case PixelFormat::rgb24:
      return 3 * w;
    case PixelFormat::nv12:
      return w;
    case PixelFormat::mjpeg:
      break;
  }
  return 0;
}

std::size_t rows_count(PixelFormat format, int height) {
  const auto h = static_cast<std::size_t>(height);
  if (format == PixelFormat::mjpeg) return 0;
  return format == PixelFormat::nv12 ? h + (h + 1) / 2 : h;
}

std::uint8_t byte_of(std::int32_t fixed16) {
  return static_cast<std::uint8_t>(std::clamp((fixed16 + (1 << 15)) >> 16, 0, 255));
}

/// What one chroma sample adds to each channel, BT.601 limited range times 2^16: 1.596 V, -0.391 U - 0.813 V, 2.018 U.
struct Chroma {
  std::int32_t r, g, b;
  Chroma(std::uint8_t u, std::uint8_t v)
      : r(104597 * (v - 128)), g(-25675 * (u - 128) - 53279 * (v - 128)), b(132201 * (u - 128)) {}
};

void put(std::uint8_t y, const Chroma& chroma, std::uint8_t* rgb) {
  const std::int32_t luma = 76309 * (y - 16);  // 1.164
  rgb[0] = byte_of(luma + chroma.r);
  rgb[1] = byte_of(luma + chroma.g);
  rgb[2] = byte_of(luma + chroma.b);
}

void yuyv_row(const std::uint8_t* row, int width, std::uint8_t* rgb) {
  for (int x = 0; x + 1 < width; x += 2, row += 4, rgb += 6) {
    const Chroma chroma(row[1], row[3]);
    put(row[0], chroma, rgb);
    put(row[2], chroma, rgb + 3);
  }
}

void nv12_row(const std::uint8_t* luma, const std::uint8_t* chroma_row, int width, std::uint8_t* rgb) {
  for (int x = 0; x + 1 < width; x += 2, luma += 2, chroma_row += 2, rgb += 6) {
    const Chroma chroma(chroma_row[0], chroma_row[1]);
    put(luma[0], chroma, rgb);
    put(luma[1], chroma, rgb + 3);
  }
}

}  // namespace

std::size_t packed_bytes(PixelFormat format, int width, int height) {
  return row_bytes_min(format, width) * rows_count(format, height);
}

bool is_whole(const RawFrame& frame) {
  if (frame.width < 1 || frame.height < 1) return false;
  if (frame.format == PixelFormat::mjpeg) return !frame.bytes.empty();
  const bool has_pairs = frame.format == PixelFormat::yuyv || frame.format == PixelFormat::nv12;
  if (has_pairs && (frame.width % 2 != 0 || (frame.format == PixelFormat::nv12 && frame.height % 2 != 0))) return false;
  const std::size_t row = row_bytes_min(frame.format, frame.width);
  const std::size_t rows = rows_count(frame.format, frame.height);
  if (frame.row_bytes < row) return false;
  return frame.bytes.size() >= (rows - 1) * frame.row_bytes + row;  // the last row may come without its padding
}

rt::Status to_depth(const RawFrame& frame, std::span<std::uint16_t> depth) {
  if (frame.format != PixelFormat::depth16) return rt::Status::unsupported;
  if (!is_whole(frame)) return rt::Status::corrupt;
  const auto width = static_cast<std::size_t>(frame.width), height = static_cast<std::size_t>(frame.height);
  TACTUS_ASSERT(depth.size() == width * height);
  for (std::size_t y = 0; y < height; ++y) {
    const auto row = depth.subspan(y * width, width);
    std::memcpy(row.data(), frame.bytes.data() + y * frame.row_bytes, 2 * width);
    for (std::uint16_t& value : row) value = value == 65535 ? std::uint16_t{0} : value;
  }
  return rt::Status::ok;
}

rt::Status to_rgb(const RawFrame& frame, std::span<std::uint8_t> rgb) {
  if (frame.format == PixelFormat::depth16) return rt::Status::unsupported;
  if (!is_whole(frame)) return rt::Status::corrupt;
  const auto width = static_cast<std::size_t>(frame.width), height = static_cast<std::size_t>(frame.height);
  TACTUS_ASSERT(rgb.size() == 3 * width * height);
  if (frame.format == PixelFormat::mjpeg) {
    const std::string_view bytes(reinterpret_cast<const char*>(frame.bytes.data()), frame.bytes.size());
    const bool is_good = decode_jpeg(bytes, frame.width, frame.height, rgb, StrayBytes::ignored).empty();
    return is_good ? rt::Status::ok : rt::Status::corrupt;
  }
  for (std::size_t y = 0; y < height; ++y) {
    const std::uint8_t* row = frame.bytes.data() + y * frame.row_bytes;
    std::uint8_t* out = rgb.data() + 3 * y * width;
    if (frame.format == PixelFormat::rgb24)
      std::memcpy(out, row, 3 * width);
    else if (frame.format == PixelFormat::yuyv)
      yuyv_row(row, frame.width, out);
    else
      nv12_row(row, frame.bytes.data() + (height + y / 2) * frame.row_bytes, frame.width, out);
  }
  return rt::Status::ok;
}

RawFrame raw_frame(std::span<const std::uint16_t> depth, const FrameHeader& header, int width, int height) {
  const auto bytes = std::as_bytes(depth);
  return {header, PixelFormat::depth16, width, height, row_bytes_min(PixelFormat::depth16, width),
          {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()}};
}

RawFrame raw_frame(std::span<const std::uint8_t> rgb, const FrameHeader& header, int width, int height) {
  return {header, PixelFormat::rgb24, width, height, row_bytes_min(PixelFormat::rgb24, width), rgb};
}

}  // namespace tactus::hal::frames
