#include "hal/libcamera/present/formats.hpp"

#include <algorithm>
#include <array>

namespace tactus::hal::libcamera {
namespace {

struct Known {
  const char* name;
  PixelFormat ours;
};
// Cheapest conversion first; mjpeg last, it costs a decoder's time and heap calls and has lost detail.
constexpr std::array<Known, 4> kKnown{{{"BGR888", PixelFormat::rgb24},
                                      {"YUYV", PixelFormat::yuyv},
                                      {"NV12", PixelFormat::nv12},
                                      {"MJPEG", PixelFormat::mjpeg}}};

bool has_size(const lc::StreamFormats& offered, const lc::PixelFormat& format, const lc::Size& size) {
  const std::vector<lc::Size> sizes = offered.sizes(format);
  if (std::find(sizes.begin(), sizes.end(), size) != sizes.end()) return true;
  const lc::SizeRange range = offered.range(format);
  return range.min != range.max && range.hStep != 0 && range.vStep != 0 && range.contains(size);
}

/// Half of the colour samples are shared by two pixels: a frame with half a pair cannot be converted.
bool has_whole_pairs(PixelFormat format, const lc::Size& size) {
  const bool pairs_x = format == PixelFormat::yuyv || format == PixelFormat::nv12;
  return !(pairs_x && size.width % 2 != 0) && !(format == PixelFormat::nv12 && size.height % 2 != 0);
}

std::optional<lc::Size> own_choice(const lc::StreamFormats& offered, const lc::PixelFormat& format) {
  const lc::Size usual{640, 480}, most{1280, 720};
  if (has_size(offered, format, usual)) return usual;
  std::optional<lc::Size> chosen;
  const auto area = [](const lc::Size& size) { return std::uint64_t{size.width} * size.height; };
  const auto fits = [&](const lc::Size& size) { return size.width <= most.width && size.height <= most.height; };
  for (const lc::Size& size : offered.sizes(format)) {
    const bool is_better = !chosen || (fits(size) ? !fits(*chosen) || area(size) > area(*chosen)
                                                  : !fits(*chosen) && area(size) < area(*chosen));
    if (is_better) chosen = size;
  }
  return chosen;
}

std::string text_of(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += (text.empty() ? "" : ", ") + line;
  return text.empty() ? "nothing" : text;
}

}  // namespace

std::optional<PixelFormat> raw_format(const lc::PixelFormat& format) {
  for (const Known& known : kKnown)
    if (lc::PixelFormat::fromString(known.name) == format) return known.ours;
  return std::nullopt;
}

rt::Result<FormatChoice> choose_format(const lc::StreamFormats& offered, const ModeRequest& mode,
                                       const std::string& format) {
  const bool has_request = mode.width > 0 && mode.height > 0;
  for (const Known& known : kKnown) {
    if (!format.empty() && format != known.name) continue;
    const lc::PixelFormat theirs = lc::PixelFormat::fromString(known.name);
    const std::vector<lc::PixelFormat> formats = offered.pixelformats();
    if (std::find(formats.begin(), formats.end(), theirs) == formats.end()) continue;
    std::optional<lc::Size> size;
    if (has_request)
      size = lc::Size(static_cast<unsigned>(mode.width), static_cast<unsigned>(mode.height));
    else
      size = own_choice(offered, theirs);
    if (!size || !has_whole_pairs(known.ours, *size) || (has_request && !has_size(offered, theirs, *size))) continue;
    return FormatChoice{theirs, known.ours, *size};
  }
  if (format == "RGB888")
    return rt::Error{rt::ExitCode::bad_usage,
                     "RGB888 is B, G, R in memory in libcamera's words and is not taken; ask for BGR888, YUYV, NV12 or "
                     "MJPEG."};
  std::string wanted = format.empty() ? "BGR888, YUYV, NV12 or MJPEG" : format;
  if (has_request) wanted += " of " + std::to_string(mode.width) + "x" + std::to_string(mode.height);
  return rt::Error{rt::ExitCode::bad_usage,
                   "has no " + wanted + " that can be taken; ask for one of what it has: " +
                       text_of(describe(offered)) + "."};
}

std::vector<std::string> describe(const lc::StreamFormats& offered) {
  std::vector<std::string> lines;
  for (const lc::PixelFormat& format : offered.pixelformats()) {
    if (!raw_format(format)) {
      lines.push_back(format.toString() + " (cannot be taken)");
      continue;
    }
    for (const lc::Size& size : offered.sizes(format))
      lines.push_back("color " + format.toString() + " " + size.toString());
  }
  return lines;
}

}  // namespace tactus::hal::libcamera
