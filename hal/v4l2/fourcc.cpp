#include "hal/v4l2/fourcc.hpp"

#include <linux/videodev2.h>

#include <array>

namespace tactus::hal::v4l2 {
namespace {

constexpr std::array kDepth{
    ReadableFormat{V4L2_PIX_FMT_Z16, PixelFormat::depth16},
    ReadableFormat{V4L2_PIX_FMT_Y16, PixelFormat::depth16},
    ReadableFormat{V4L2_PIX_FMT_Y12, PixelFormat::depth16},  // twelve bits in sixteen, upper ones 0
};
constexpr std::array kColor{
    ReadableFormat{V4L2_PIX_FMT_YUYV, PixelFormat::yuyv},
    ReadableFormat{V4L2_PIX_FMT_NV12, PixelFormat::nv12},
    ReadableFormat{V4L2_PIX_FMT_RGB24, PixelFormat::rgb24},
    ReadableFormat{V4L2_PIX_FMT_MJPEG, PixelFormat::mjpeg},
};
constexpr std::uint32_t kBigEndian = 1U << 31;

}  // namespace

std::span<const ReadableFormat> readable_formats(Stream stream) {
  if (stream == Stream::depth) return kDepth;
  return kColor;
}

std::string fourcc_text(std::uint32_t fourcc) {
  std::string text;
  for (unsigned shift = 0; shift < 32; shift += 8) {
    const auto c = static_cast<unsigned char>((fourcc & ~kBigEndian) >> shift & 0xff);
    text += c >= ' ' && c <= '~' ? static_cast<char>(c) : '?';
  }
  text.erase(text.find_last_not_of(' ') + 1);
  if ((fourcc & kBigEndian) != 0) text += "-BE";
  return text;
}

std::optional<std::uint32_t> parse_fourcc(std::string_view text) {
  const bool is_big_endian = text.size() > 3 && text.ends_with("-BE");
  if (is_big_endian) text.remove_suffix(3);
  if (text.empty()) return std::nullopt;
  std::uint32_t fourcc = is_big_endian ? kBigEndian : 0;
  std::string upper;
  for (const char c : text) upper += c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
  if (upper == "MJPEG") upper = "MJPG";
  if (upper.size() > 4) return std::nullopt;
  upper.resize(4, ' ');
  for (unsigned i = 0; i < 4; ++i) {
    const auto c = static_cast<unsigned char>(upper[i]);
    if (c < ' ' || c > '~') return std::nullopt;
    fourcc |= static_cast<std::uint32_t>(c) << (8 * i);
  }
  return fourcc;
}

}  // namespace tactus::hal::v4l2
