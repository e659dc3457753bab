#include "hal/replay/intrinsics_file.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <vector>

#include "hal/replay/text.hpp"

namespace tactus::hal::replay {
namespace {

std::optional<int> parse_side(std::string_view word) {
  const auto count = parse_count(word);
  if (!count || *count > static_cast<std::uint64_t>(kImageSideMax)) return std::nullopt;
  return static_cast<int>(*count);
}

/// Shortest text that reads back to the same double.
std::string exact(double value) {
  std::array<char, 32> buffer{};
  const auto [end, error] = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value);
  return error == std::errc{} ? std::string(buffer.data(), end) : "0";
}

/// "fx fy cx cy width height" from the front of `rest`.
std::optional<Intrinsics> take_pinhole(std::string_view& rest) {
  Intrinsics out;
  for (double* value : {&out.fx, &out.fy, &out.cx, &out.cy}) {
    const auto number = parse_number(next_word(rest));
    if (!number) return std::nullopt;
    *value = *number;
  }
  const auto width = parse_side(next_word(rest));
  const auto height = parse_side(next_word(rest));
  if (!width || !height) return std::nullopt;
  out.width = *width;
  out.height = *height;
  return out;
}

}  // namespace

std::string fault_of(const Intrinsics& k) {
  if (k.width < 1 || k.height < 1 || k.width > kImageSideMax || k.height > kImageSideMax ||
      static_cast<long>(k.width) * k.height > kImagePixelsMax)
    return "width and height must be 1 to " + std::to_string(kImageSideMax) +
           " pixels and 16 Mpixel together";
  for (const double f : {k.fx, k.fy})
    if (!(f >= 1 && f <= 1e5)) return "focal lengths must be 1 to 100000 pixels";
  if (!(k.cx >= -k.width && k.cx <= 2.0 * k.width && k.cy >= -k.height && k.cy <= 2.0 * k.height))
    return "the centre cx cy is far outside of the image";
  for (const double d : {k.k1, k.k2, k.p1, k.p2, k.k3})
    if (!(std::fabs(d) <= 100)) return "a distortion coefficient is not a number below 100";
  return {};
}

rt::Result<RigCalibration> parse_intrinsics(std::string_view text, std::string_view file) {
  constexpr std::string_view kForm = "must be \"fx fy cx cy width height depth_scale\" (units per metre)";
  std::optional<RigCalibration> out;
  LineReader lines(text);
  std::string_view line;
  while (lines.next(line)) {
    if (is_blank_or_comment(line)) continue;
    if (out) return bad_input(file, lines.line_number(), "a second line of values; there must be one");
    std::string_view rest = line;
    const auto pinhole = take_pinhole(rest);
    const auto units_per_m = parse_number(next_word(rest));
    if (!pinhole || !units_per_m || !next_word(rest).empty())
      return bad_input(file, lines.line_number(), quote(line) + " " + std::string(kForm));
    if (!(*units_per_m >= 1 && *units_per_m <= 1e6))
      return bad_input(file, lines.line_number(), "the depth scale must be 1 to 1000000 units per metre");
    if (const std::string fault = fault_of(*pinhole); !fault.empty())
      return bad_input(file, lines.line_number(), fault);
    out.emplace();
    out->depth = *pinhole;
    out->color = *pinhole;
    out->registered = true;
    out->depth_m_per_unit = 1 / *units_per_m;
  }
  if (!out) return bad_input(file, 0, "has no values; one line " + std::string(kForm));
  return *out;
}

rt::Result<Intrinsics> parse_camera_matrix(std::string_view text, std::string_view file) {
  std::array<double, 9> v{};
  std::size_t count = 0;
  LineReader lines(text);
  std::string_view line;
  while (lines.next(line)) {
    if (is_blank_or_comment(line)) continue;
    for (std::string_view word = next_word(line); !word.empty(); word = next_word(line)) {
      const auto number = parse_number(word);
      if (!number) return bad_input(file, lines.line_number(), quote(word) + " is not a finite number");
      if (count == v.size())
        return bad_input(file, lines.line_number(), "more than the 9 numbers of a 3x3 matrix");
      v[count++] = *number;
    }
  }
  if (count != v.size())
    return bad_input(file, 0, "has " + std::to_string(count) + " numbers; a 3x3 camera matrix has 9");
  if (v[1] != 0 || v[3] != 0 || v[6] != 0 || v[7] != 0 || v[8] != 1)
    return bad_input(file, 0, "is no pinhole matrix: fx 0 cx, 0 fy cy, 0 0 1");
  Intrinsics out;
  out.fx = v[0];
  out.fy = v[4];
  out.cx = v[2];
  out.cy = v[5];
  return out;
}

rt::Result<RigCalibration> parse_calibration_text(std::string_view text, std::string_view file) {
  RigCalibration out;
  bool has_depth = false;
  LineReader lines(text);
  std::string_view line;
  while (lines.next(line)) {
    if (is_blank_or_comment(line)) continue;
    const int number = lines.line_number();
    std::string_view rest = line;
    const std::string_view camera = next_word(rest);
    if (camera != "depth" && camera != "color")
      return bad_input(file, number, quote(camera) + " is neither \"depth\" nor \"color\"");
    if (camera == "depth" ? has_depth : out.has_color)
      return bad_input(file, number, "a second " + std::string(camera) + " line; there must be one");
    const auto pinhole = take_pinhole(rest);
    if (!pinhole)
      return bad_input(file, number, "must be \"" + std::string(camera) + " fx fy cx cy width height\"");
    if (const std::string fault = fault_of(*pinhole); !fault.empty()) return bad_input(file, number, fault);
    if (camera == "depth") {
      has_depth = true;
      out.depth = *pinhole;
    } else {
      out.has_color = true;
      out.color = *pinhole;
    }
    for (std::string_view key = next_word(rest); !key.empty(); key = next_word(rest)) {
      Vec3d& t = out.T_color_depth.translation;
      double* value = key == "tx" ? &t.x : key == "ty" ? &t.y : key == "tz" ? &t.z : nullptr;
      const auto metres = parse_number(next_word(rest));
      if (camera == "depth" || value == nullptr || !metres || !(std::fabs(*metres) <= 10))
        return bad_input(file, number,
                         quote(key) + ": only tx, ty, tz in metres may follow, on the color line");
      *value = *metres;
    }
  }
  if (!has_depth) return bad_input(file, 0, "has no line \"depth fx fy cx cy width height\"");
  return out;
}

std::string format_intrinsics(const RigCalibration& c) {
  // 1 / (1 / 5000.0) is 5000 again for all whole scales in use; where it is not, the nearest whole number is
  // tried.
  double units_per_m = 1 / c.depth_m_per_unit;
  if (const double whole = std::round(units_per_m); 1 / whole == c.depth_m_per_unit) units_per_m = whole;
  std::string out = "# fx fy cx cy width height depth_scale (units per metre)\n";
  for (const double v : {c.depth.fx, c.depth.fy, c.depth.cx, c.depth.cy}) out += exact(v) + " ";
  return out + std::to_string(c.depth.width) + " " + std::to_string(c.depth.height) + " " +
         exact(units_per_m) + "\n";
}

std::string format_calibration_toml(const RigCalibration& c) {
  const auto array = [](std::initializer_list<double> values) {
    std::string out = "[";
    for (const double v : values) out += (out.size() > 1 ? ", " : "") + exact(v);
    return out + "]\n";
  };
  const auto camera = [&](const Intrinsics& k) {
    std::string out = "width = " + std::to_string(k.width) + "\nheight = " + std::to_string(k.height) + "\n";
    out += "fx = " + exact(k.fx) + "\nfy = " + exact(k.fy) + "\ncx = " + exact(k.cx) +
           "\ncy = " + exact(k.cy) + "\n";
    if (k.has_distortion()) out += "distortion = " + array({k.k1, k.k2, k.p1, k.p2, k.k3});
    return out;
  };
  std::string out =
      "# Pixel centres at integers; p_color = rotation * p_depth + translation_m; distortion k1 k2 p1 p2 "
      "k3\n";
  out += "format = 1\nregistered = " + std::string(c.registered ? "true" : "false") + "\n\n[depth]\n";
  out += camera(c.depth) + "m_per_unit = " + exact(c.depth_m_per_unit) + "\n";
  if (c.has_color && !c.registered) {
    const auto& m = c.T_color_depth.rotation.m;
    const Vec3d& t = c.T_color_depth.translation;
    out += "\n[color]\n" + camera(c.color) + "\n[color.from_depth]\n";
    out += "rotation = " + array({m[0], m[1], m[2], m[3], m[4], m[5], m[6], m[7], m[8]});
    out += "translation_m = " + array({t.x, t.y, t.z});
  }
  return out;
}

}  // namespace tactus::hal::replay
