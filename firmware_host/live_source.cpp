#include "firmware_host/live_source.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>

#include "hal/replay/intrinsics_file.hpp"
#include "hal/toml/toml_text.hpp"

namespace tactus::firmware {
namespace {

constexpr int kImageSideMax = 8192;
// TUM's default for a PrimeSense camera: 525 px at 640 px across.
constexpr double kAssumedFocal = 525.0 / 640.0;

bool parse_side(std::string_view word, int& out) {
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), out);
  return error == std::errc{} && end == word.data() + word.size() && out >= 1 && out <= kImageSideMax;
}

std::optional<bool> parse_switch(std::string_view word) {
  if (word != "0" && word != "1") return std::nullopt;
  return word == "1";
}

std::optional<Controls> parse_controls(std::string_view text) {
  Controls controls;
  while (!text.empty()) {
    const std::size_t comma = text.find(',');
    const std::string_view one = text.substr(0, comma);
    const std::size_t colon = one.find(':');
    if (colon == std::string_view::npos || colon == 0 || colon + 1 == one.size()) return std::nullopt;
    controls.emplace_back(one.substr(0, colon), one.substr(colon + 1));
    if (comma == std::string_view::npos) return controls;
    text.remove_prefix(comma + 1);
  }
  return std::nullopt;
}

bool parse_buffers(std::string_view text, LiveSource& source) {
  const std::size_t colon = text.find(':');
  source.buffers = text.substr(0, colon);
  if (colon != std::string_view::npos) source.dmabuf_exporter = text.substr(colon + 1);
  const bool has_exporter = colon != std::string_view::npos;
  if (source.buffers == "dmabuf") return !has_exporter || !source.dmabuf_exporter.empty();
  return !has_exporter && (source.buffers == "mmap" || source.buffers == "userptr");
}

/// Which kinds of source have a key.
enum : unsigned { kV4l2 = 1, kOpenNi2 = 2 };

struct Key {
  std::string_view name;
  unsigned kinds;
  const char* takes;
  bool (*set)(LiveSource&, std::string_view);
};

constexpr auto kText = [](std::string& out, std::string_view text) {
  out = text;
  return !text.empty();
};

constexpr std::array kKeys = {
    Key{"mode", kV4l2 | kOpenNi2, "WIDTHxHEIGHT, WIDTHxHEIGHT@HZ or @HZ",
        [](LiveSource& s, std::string_view text) {
          const auto mode = parse_mode(text);
          if (mode) s.mode = *mode;
          return mode.has_value();
        }},
    Key{"color_mode", kV4l2 | kOpenNi2, "WIDTHxHEIGHT, WIDTHxHEIGHT@HZ or @HZ",
        [](LiveSource& s, std::string_view text) {
          const auto mode = parse_mode(text);
          if (mode) s.color_mode = *mode;
          return mode.has_value();
        }},
    Key{"color", kV4l2 | kOpenNi2, "a V4L2 node such as /dev/video0, or libcamera:ID",
        [](LiveSource& s, std::string_view text) {
          s.color = text;
          return text.starts_with("/") || text == "libcamera" || text.starts_with("libcamera:");
        }},
    Key{"format", kV4l2, "a pixel format by its name, such as Z16 or Y16",
        [](LiveSource& s, std::string_view text) { return kText(s.format, text); }},
    Key{"color_format", kV4l2 | kOpenNi2, "a pixel format by its name, such as YUYV, NV12 or MJPG",
        [](LiveSource& s, std::string_view text) { return kText(s.color_format, text); }},
    Key{"buffers", kV4l2, "mmap, userptr, dmabuf or dmabuf:EXPORTER",
        [](LiveSource& s, std::string_view text) { return parse_buffers(text, s); }},
    Key{"controls", kV4l2, "NAME:VALUE,NAME:VALUE...",
        [](LiveSource& s, std::string_view text) {
          const auto controls = parse_controls(text);
          if (controls) s.controls = *controls;
          return controls.has_value();
        }},
    Key{"color_controls", kV4l2 | kOpenNi2, "NAME:VALUE,NAME:VALUE...",
        [](LiveSource& s, std::string_view text) {
          const auto controls = parse_controls(text);
          if (controls) s.color_controls = *controls;
          return controls.has_value();
        }},
    Key{"registered", kOpenNi2, "0 or 1",
        [](LiveSource& s, std::string_view text) { return (s.is_registered = parse_switch(text)).has_value(); }},
    Key{"sync", kOpenNi2, "0 or 1",
        [](LiveSource& s, std::string_view text) { return (s.is_synchronized = parse_switch(text)).has_value(); }},
    Key{"calibration", kV4l2 | kOpenNi2, "a file as `tactus convert` writes it (calibration.toml)",
        [](LiveSource& s, std::string_view text) { return kText(s.calibration, text); }},
    Key{"accelerometer", kV4l2 | kOpenNi2, "iio:deviceN, or its folder",
        [](LiveSource& s, std::string_view text) {
          s.accelerometer = text;
          return text.starts_with("/") || (text.starts_with("iio:") && text.size() > 4);
        }},
};

std::string keys_of(unsigned kind) {
  std::string names;
  for (const Key& key : kKeys)
    if ((key.kinds & kind) != 0) names += (names.empty() ? "" : ", ") + std::string(key.name);
  return names;
}

bool is_kind(std::string_view source, std::string_view kind) {
  return source.starts_with(kind) &&
         (source.size() == kind.size() || source[kind.size()] == ':' || source[kind.size()] == '?');
}

void scale(hal::Intrinsics& camera, ImageSize size) {
  const double s = static_cast<double>(size.width) / camera.width;
  camera.fx *= s;
  camera.fy *= s;
  camera.cx = (camera.cx + 0.5) * s - 0.5;
  camera.cy = (camera.cy + 0.5) * s - 0.5;
  camera.width = size.width;
  camera.height = size.height;
}

std::string size_text(int width, int height) { return std::to_string(width) + "x" + std::to_string(height); }

rt::Result<void> bring_to(hal::Intrinsics& camera, ImageSize size, const std::string& file, const char* which) {
  if (camera.width * size.height != camera.height * size.width)
    return rt::Error{rt::ExitCode::bad_usage,
                     file + ": [" + which + "] is of " + size_text(camera.width, camera.height) +
                         " and the camera delivers " + size_text(size.width, size.height) +
                         ", which is another part of its view; ask for a mode of that shape or calibrate this one."};
  scale(camera, size);
  return {};
}

hal::Intrinsics assumed_camera(ImageSize size) {
  hal::Intrinsics camera;
  camera.width = size.width;
  camera.height = size.height;
  camera.fx = camera.fy = kAssumedFocal * size.width;
  camera.cx = size.width * 0.5 - 0.5;
  camera.cy = size.height * 0.5 - 0.5;
  return camera;
}

}  // namespace

bool is_live_source(std::string_view source) {
  return is_kind(source, "v4l2") || is_kind(source, "openni2") || is_kind(source, "libcamera");
}

std::optional<hal::ModeRequest> parse_mode(std::string_view text) {
  hal::ModeRequest mode;
  const std::size_t at = text.find('@');
  if (at != std::string_view::npos) {
    const std::string_view rate = text.substr(at + 1);
    const auto [end, error] = std::from_chars(rate.data(), rate.data() + rate.size(), mode.frame_rate_hz);
    if (error != std::errc{} || end != rate.data() + rate.size() ||
        !(mode.frame_rate_hz >= 1 && mode.frame_rate_hz <= 1000))
      return std::nullopt;
    if (at == 0) return mode;
  }
  const std::string_view size = text.substr(0, at);
  const std::size_t x = size.find('x');
  if (x == std::string_view::npos || !parse_side(size.substr(0, x), mode.width) ||
      !parse_side(size.substr(x + 1), mode.height))
    return std::nullopt;
  return mode;
}

std::string mode_text(const hal::ModeRequest& mode) {
  std::array<char, 64> text{};
  if (mode.width > 0) std::snprintf(text.data(), text.size(), "%dx%d", mode.width, mode.height);
  std::string out = text.data();
  if (mode.frame_rate_hz > 0) {
    std::snprintf(text.data(), text.size(), "@%g", mode.frame_rate_hz);
    out += text.data();
  }
  return out;
}

rt::Result<LiveSource> parse_live_source(std::string_view source) {
  const auto bad = [&](const std::string& what) {
    return rt::Error{rt::ExitCode::bad_usage, "source '" + std::string(source) + "': " + what};
  };
  if (is_kind(source, "libcamera"))
    return bad(
        "libcamera has colour cameras only; pair one with a depth camera, as in 'openni2?color=libcamera:ID' or "
        "'v4l2:NODE?color=libcamera:ID'.");
  LiveSource out;
  out.kind = is_kind(source, "v4l2") ? LiveKind::v4l2 : LiveKind::openni2;
  const unsigned kind = out.kind == LiveKind::v4l2 ? kV4l2 : kOpenNi2;
  const std::string_view name = out.kind == LiveKind::v4l2 ? "v4l2" : "openni2";
  std::string_view rest = source.substr(name.size());
  const std::size_t question = rest.find('?');
  std::string_view options = question == std::string_view::npos ? "" : rest.substr(question + 1);
  rest = rest.substr(0, question);
  if (!rest.empty()) out.device = rest.substr(1);
  if (out.kind == LiveKind::v4l2 && out.device.empty())
    return bad("it needs the node of a depth camera, as in v4l2:/dev/video2; `tactus devices` lists them.");
  if (!rest.empty() && out.device.empty()) return bad("after ':' comes the device; `tactus devices` lists them.");

  std::vector<std::string_view> seen;
  while (!options.empty()) {
    const std::size_t end = options.find('&');
    const std::string_view option = options.substr(0, end);
    options = end == std::string_view::npos ? "" : options.substr(end + 1);
    const std::size_t equals = option.find('=');
    const std::string_view key = option.substr(0, equals);
    const Key* known = nullptr;
    for (const Key& k : kKeys)
      if (k.name == key && (k.kinds & kind) != 0) known = &k;
    if (known == nullptr)
      return bad("'" + std::string(key) + "' is no key of " + std::string(name) + "; known are " + keys_of(kind) + ".");
    for (const std::string_view before : seen)
      if (before == key) return bad("'" + std::string(key) + "' is there twice.");
    seen.push_back(key);
    const std::string_view value = equals == std::string_view::npos ? "" : option.substr(equals + 1);
    if (!known->set(out, value))
      return bad(std::string(key) + " takes " + known->takes + ", not '" + std::string(value) + "'.");
  }
  if (out.color.empty() && out.kind == LiveKind::v4l2)
    for (const std::string_view key : seen)
      if (key.starts_with("color_")) return bad(std::string(key) + " needs color=, the node of a colour camera.");
  if (!out.color.empty() && out.is_registered == true)
    return bad("registered=1 is of OpenNI2's own colour camera, and color= names another one.");
  return out;
}

rt::Result<hal::RigCalibration> fit_calibration(hal::RigCalibration rig, const std::string& file, ImageSize depth,
                                                ImageSize color) {
  const bool has_color = color.width > 0;
  if (rig.registered && has_color && (color.width != depth.width || color.height != depth.height))
    return rt::Error{rt::ExitCode::bad_usage,
                     file + ": registered = true says that colour shares the depth camera's pixels, but depth is " +
                         size_text(depth.width, depth.height) + " and colour " + size_text(color.width, color.height) +
                         "; ask both for one mode."};
  if (!rig.registered && has_color && !rig.has_color)
    return rt::Error{rt::ExitCode::bad_usage, file + ": there is no [color], and the source has a colour camera."};
  if (auto fits = bring_to(rig.depth, depth, file, "depth"); !fits) return fits.error();
  if (rig.registered)
    rig.color = rig.depth;
  else if (has_color)
    if (auto fits = bring_to(rig.color, color, file, "color"); !fits) return fits.error();
  rig.has_color = has_color;
  if (!has_color) {
    rig.registered = false;
    rig.color = {};
    rig.T_color_depth = {};
  }
  return rig;
}

hal::RigCalibration assumed_calibration(ImageSize depth, ImageSize color) {
  hal::RigCalibration rig;
  rig.depth = assumed_camera(depth);
  rig.has_color = color.width > 0;
  if (rig.has_color) rig.color = assumed_camera(color);
  return rig;
}

rt::Result<hal::RigCalibration> calibration_for(const std::string& file, ImageSize depth, ImageSize color,
                                                std::vector<std::string>& notes) {
  if (file.empty()) {
    notes.push_back(
        "nothing is known of the cameras' lenses: 62.7 degrees across" +
        std::string(color.width > 0 ? " for both, side by side at one place" : "") +
        " and 1 mm per unit are assumed; say ?calibration=FILE.toml");
    return assumed_calibration(depth, color);
  }
  const auto text = hal::read_settings_file(file, "calibration");
  if (!text) return text.error();
  auto rig = hal::replay::parse_calibration_toml(*text, file);
  if (!rig) return rig.error();
  return fit_calibration(std::move(*rig), file, depth, color);
}

rt::Result<hal::Sensor> compose_sensor(hal::LiveCamera<hal::DepthCamera> depth,
                                       std::optional<hal::LiveCamera<hal::ColorCamera>> color,
                                       const std::string& calibration_file) {
  hal::Sensor sensor;
  sensor.is_live = true;
  sensor.description = depth.description;
  sensor.notes = std::move(depth.notes);
  sensor.frame_rate_hz = depth.frame_rate_hz;
  sensor.buffers_bytes = depth.buffers_bytes;
  sensor.depth = std::move(depth.camera);
  ImageSize color_size;
  if (color) {
    color_size = {color->width, color->height};
    sensor.description += "; colour: " + color->description;
    sensor.notes.insert(sensor.notes.end(), color->notes.begin(), color->notes.end());
    sensor.buffers_bytes += color->buffers_bytes;
    sensor.has_two_clocks = !(depth.has_host_clock && color->has_host_clock);
    sensor.color = std::move(color->camera);
  }
  auto rig = calibration_for(calibration_file, {depth.width, depth.height}, color_size, sensor.notes);
  if (!rig) return rig.error();
  sensor.calibration = *rig;
  return sensor;
}

}  // namespace tactus::firmware
