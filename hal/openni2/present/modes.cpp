#include "hal/openni2/present/modes.hpp"

#include <cmath>
#include <tuple>

namespace tactus::hal::openni2 {
namespace {

const char* name(OniPixelFormat format) {
  switch (format) {
    case ONI_PIXEL_FORMAT_DEPTH_1_MM:
      return "depth 1 mm";
    case ONI_PIXEL_FORMAT_DEPTH_100_UM:
      return "depth 0.1 mm";
    case ONI_PIXEL_FORMAT_RGB888:
      return "colour RGB";
    case ONI_PIXEL_FORMAT_YUYV:
      return "colour YUYV";
    case ONI_PIXEL_FORMAT_JPEG:
      return "colour JPEG";
    default:
      return "unusable";
  }
}

bool is_same(const OniVideoMode& a, const OniVideoMode& b) {
  return a.pixelFormat == b.pixelFormat && a.resolutionX == b.resolutionX && a.resolutionY == b.resolutionY &&
         a.fps == b.fps;
}

}  // namespace

std::optional<PixelFormat> format_of(OniPixelFormat format) {
  switch (format) {
    case ONI_PIXEL_FORMAT_DEPTH_1_MM:
    case ONI_PIXEL_FORMAT_DEPTH_100_UM:
      return PixelFormat::depth16;
    case ONI_PIXEL_FORMAT_RGB888:
      return PixelFormat::rgb24;
    case ONI_PIXEL_FORMAT_YUYV:
      return PixelFormat::yuyv;
    case ONI_PIXEL_FORMAT_JPEG:
      return PixelFormat::mjpeg;
    default:
      return std::nullopt;
  }
}

std::string to_string(const OniVideoMode& mode) {
  return std::string(name(mode.pixelFormat)) + " " + std::to_string(mode.resolutionX) + "x" +
         std::to_string(mode.resolutionY) + " " + std::to_string(mode.fps) + " Hz";
}

std::optional<OniVideoMode> choose_mode(std::span<const OniVideoMode> modes, const OniVideoMode& current,
                                        const ModeRequest& request) {
  std::optional<OniVideoMode> best;
  const auto rank = [&](const OniVideoMode& mode) {
    const bool is_plain = mode.pixelFormat == ONI_PIXEL_FORMAT_DEPTH_1_MM || mode.pixelFormat == ONI_PIXEL_FORMAT_RGB888;
    const bool is_usual = mode.resolutionX == 640 && mode.resolutionY == 480;
    return std::tuple(is_same(mode, current), is_usual, mode.fps == 30, is_plain);
  };
  for (const OniVideoMode& mode : modes) {
    if (!format_of(mode.pixelFormat) || mode.resolutionX < 1 || mode.resolutionY < 1) continue;
    if (request.width != 0 && mode.resolutionX != request.width) continue;
    if (request.height != 0 && mode.resolutionY != request.height) continue;
    if (request.frame_rate_hz != 0 && std::fabs(mode.fps - request.frame_rate_hz) > 0.5) continue;
    if (!best || rank(mode) > rank(*best)) best = mode;
  }
  return best;
}

std::optional<OniVideoMode> choose_color_mode(std::span<const OniVideoMode> modes, const OniVideoMode& current,
                                              const OniVideoMode& depth) {
  const ModeRequest same{depth.resolutionX, depth.resolutionY, static_cast<double>(depth.fps)};
  for (const ModeRequest& request : {same, ModeRequest{same.width, same.height, 0}, ModeRequest{0, 0, same.frame_rate_hz}})
    if (auto mode = choose_mode(modes, current, request)) return mode;
  return choose_mode(modes, current, {});
}

}  // namespace tactus::hal::openni2
