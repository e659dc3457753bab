#include "hal/record/file_header.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <span>

#include "hal/toml/toml_text.hpp"

namespace tactus::hal::record {
namespace {

constexpr int kSideMax = 8192;
constexpr std::int64_t kPixelsMax = std::int64_t{16} << 20;

/// Shortest text that reads back to the same double, with a point or an exponent: TOML takes others for whole numbers,
/// which have no -0.
std::string exact(double value) {
  std::array<char, 32> buffer{};
  const auto [end, error] = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value);
  std::string text = error == std::errc{} ? std::string(buffer.data(), end) : "0";
  if (text.find_first_of(".en") == std::string::npos) text += ".0";
  return text;
}

std::string array_of(std::span<const double> values) {
  std::string text = "[";
  for (std::size_t i = 0; i < values.size(); ++i) text += (i == 0 ? "" : ", ") + exact(values[i]);
  return text + "]";
}

/// The code point at the front of `text`, and how many bytes it takes; '?' and one byte for what is no UTF-8.
std::pair<char32_t, std::size_t> code_point(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char lead = byte(0);
  if (lead < 0x80) return {lead, 1};
  const std::size_t count = lead >= 0xF0 ? 4 : lead >= 0xE0 ? 3 : 2;
  if (lead < 0xC2 || lead > 0xF4 || text.size() < count) return {U'?', 1};
  char32_t code = lead & (0x7FU >> count);
  for (std::size_t i = 1; i < count; ++i) {
    if ((byte(i) & 0xC0) != 0x80) return {U'?', 1};
    code = code << 6 | (byte(i) & 0x3FU);
  }
  constexpr std::array<char32_t, 5> kLeast{0, 0, 0x80, 0x800, 0x10000};
  const bool is_surrogate = code >= 0xD800 && code <= 0xDFFF;
  if (code < kLeast[count] || code > 0x10FFFF || is_surrogate) return {U'?', 1};
  return {code, count};
}

std::string toml_string(std::string_view text) {
  std::string out = "\"";
  while (!text.empty()) {
    const auto [code, count] = code_point(text);
    text.remove_prefix(count);
    if (code >= 0x20 && code < 0x7F) {
      if (code == U'"' || code == U'\\') out += '\\';
      out += static_cast<char>(code);
      continue;
    }
    std::array<char, 16> escape{};
    std::snprintf(escape.data(), escape.size(), "\\U%08X", static_cast<unsigned>(code));
    out += escape.data();
  }
  return out + "\"";
}

std::string truth_of(bool value) { return value ? "true" : "false"; }

std::string camera_text(const Intrinsics& k) {
  std::string text = "width = " + std::to_string(k.width) + "\nheight = " + std::to_string(k.height) + "\n";
  const std::array<double, 4> pinhole{k.fx, k.fy, k.cx, k.cy};
  const std::array<double, 5> distortion{k.k1, k.k2, k.p1, k.p2, k.k3};
  return text + "fx_fy_cx_cy = " + array_of(pinhole) + "\ndistortion = " + array_of(distortion) + "\n";
}

/// Takes values out of one table and keeps the first complaint.
class Reader {
 public:
  Reader(const toml::table& table, std::string name, std::string& complaint)
      : table_(table), name_(std::move(name)), complaint_(complaint) {}

  void numbers(std::string_view key, std::span<double> out) {
    const toml::array* array = table_.get_as<toml::array>(key);
    if (array == nullptr || array->size() != out.size())
      return complain(key, "must be " + std::to_string(out.size()) + " numbers");
    for (std::size_t i = 0; i < out.size(); ++i) {
      const auto value = array->get(i)->value<double>();
      if (!value || !std::isfinite(*value)) return complain(key, "must be finite numbers");
      out[i] = *value;
    }
  }
  void positive(std::string_view key, double& out) {
    const auto value = table_[key].value<double>();
    if (!value || !(*value > 0) || !std::isfinite(*value)) return complain(key, "must be a number above 0");
    out = *value;
  }
  void side(std::string_view key, int& out) {
    const auto value = table_[key].value_exact<std::int64_t>();
    if (!value || *value < 1 || *value > kSideMax) return complain(key, "must be 1 to 8192 pixels");
    out = static_cast<int>(*value);
  }
  void flag(std::string_view key, bool& out) {
    const auto value = table_[key].value_exact<bool>();
    if (!value) return complain(key, "must be true or false");
    out = *value;
  }
  void text(std::string_view key, std::string& out) {
    const auto value = table_[key].value_exact<std::string>();
    if (!value) return complain(key, "must be a text");
    out = *value;
  }
  const toml::table* table(std::string_view key, bool is_required) {
    const toml::table* found = table_.get_as<toml::table>(key);
    if (found == nullptr && (is_required || table_.contains(key))) complain(key, "must be a table");
    return found;
  }
  [[nodiscard]] bool has(std::string_view key) const { return table_.contains(key); }
  [[nodiscard]] const toml::array* array(std::string_view key) const { return table_.get_as<toml::array>(key); }

  void complain(std::string_view key, const std::string& what) {
    if (complaint_.empty()) complaint_ = name_ + std::string(key) + " " + what;
  }

 private:
  const toml::table& table_;
  std::string name_;  // with a dot behind it; empty for the root
  std::string& complaint_;
};

void read_camera(const toml::table& table, const std::string& name, Intrinsics& out, std::string& complaint) {
  Reader reader(table, name, complaint);
  reader.side("width", out.width);
  reader.side("height", out.height);
  if (std::int64_t{out.width} * out.height > kPixelsMax) reader.complain("width", "and height are beyond 16 Mpixel");
  std::array<double, 4> pinhole{};
  reader.numbers("fx_fy_cx_cy", pinhole);
  if (!(pinhole[0] > 0 && pinhole[1] > 0)) reader.complain("fx_fy_cx_cy", "must have focal lengths above 0");
  std::array<double, 5> d{};
  reader.numbers("distortion", d);
  out.fx = pinhole[0], out.fy = pinhole[1], out.cx = pinhole[2], out.cy = pinhole[3];
  out.k1 = d[0], out.k2 = d[1], out.p1 = d[2], out.p2 = d[3], out.k3 = d[4];
}

bool is_rotation(const Rotation& rotation) {
  const Rotation product = rotation * rotation.transposed();
  double worst = 0;
  for (std::size_t i = 0; i < 9; ++i) worst = std::max(worst, std::fabs(product.m[i] - (i % 4 == 0 ? 1 : 0)));
  const Vec3d x{rotation(0, 0), rotation(1, 0), rotation(2, 0)}, y{rotation(0, 1), rotation(1, 1), rotation(2, 1)};
  const Vec3d z{rotation(0, 2), rotation(1, 2), rotation(2, 2)};
  return worst <= 1e-6 && x.cross(y).dot(z) > 0;
}

void read_info(const toml::array& rows, TacInfo& out, Reader& reader) {
  for (const toml::node& row : rows) {
    const toml::array* pair = row.as_array();
    if (pair == nullptr || pair->size() != 2 || !pair->get(0)->is_string() || !pair->get(1)->is_string())
      return reader.complain("info", "must be pairs of texts");
    out.entries.emplace_back(*pair->get(0)->value<std::string>(), *pair->get(1)->value<std::string>());
  }
}

}  // namespace

std::string format_file_header(const FileHeader& header) {
  const RigCalibration& rig = header.calibration;
  std::string text = "# What this recording holds; see hal/record/chunk.hpp of tactus.\nformat = 1\n";
  text += "description = " + toml_string(header.description) + "\n";
  text += "frame_rate_hz = " + exact(header.frame_rate_hz) + "\n";
  text += "was_live = " + truth_of(header.was_live) + "\n";
  text += "has_two_clocks = " + truth_of(header.has_two_clocks) + "\n";
  text += "has_color = " + truth_of(rig.has_color) + "\n";
  text += "registered = " + truth_of(rig.registered) + "\n";
  if (header.gravity_depth) {
    const Vec3d& g = *header.gravity_depth;
    text += "gravity_depth = " + array_of(std::array<double, 3>{g.x, g.y, g.z}) + "\n";
  }
  text += "info = [\n";
  for (const auto& [key, value] : header.info.entries) text += "  [" + toml_string(key) + ", " + toml_string(value) + "],\n";
  text += "]\n\n[depth]\n" + camera_text(rig.depth) + "m_per_unit = " + exact(rig.depth_m_per_unit) + "\n";
  if (!rig.has_color) return text;
  const Vec3d& t = rig.T_color_depth.translation;
  return text + "\n[color]\n" + camera_text(rig.color) +
         "from_depth_rotation = " + array_of(rig.T_color_depth.rotation.m) +
         "\nfrom_depth_translation_m = " + array_of(std::array<double, 3>{t.x, t.y, t.z}) + "\n";
}

rt::Result<FileHeader> parse_file_header(std::string_view text, const std::string& file) {
  auto root = parse_toml(text, file, rt::ExitCode::bad_input);
  if (!root) return root.error();
  FileHeader out;
  RigCalibration& rig = out.calibration;
  std::string complaint;
  Reader reader(*root, "", complaint);
  reader.text("description", out.description);
  reader.positive("frame_rate_hz", out.frame_rate_hz);
  reader.flag("was_live", out.was_live);
  reader.flag("has_two_clocks", out.has_two_clocks);
  reader.flag("has_color", rig.has_color);
  reader.flag("registered", rig.registered);
  if (reader.has("gravity_depth")) {
    std::array<double, 3> g{};
    reader.numbers("gravity_depth", g);
    out.gravity_depth = Vec3d{g[0], g[1], g[2]};
    if (!(std::fabs(out.gravity_depth->norm() - 1) <= 1e-6)) reader.complain("gravity_depth", "must be of length 1");
  }
  if (const toml::array* info = reader.array("info")) read_info(*info, out.info, reader);
  if (const toml::table* depth = reader.table("depth", true)) {
    read_camera(*depth, "depth.", rig.depth, complaint);
    Reader(*depth, "depth.", complaint).positive("m_per_unit", rig.depth_m_per_unit);
  }
  if (const toml::table* color = reader.table("color", rig.has_color); color != nullptr && rig.has_color) {
    read_camera(*color, "color.", rig.color, complaint);
    Reader of_color(*color, "color.", complaint);
    of_color.numbers("from_depth_rotation", rig.T_color_depth.rotation.m);
    std::array<double, 3> t{};
    of_color.numbers("from_depth_translation_m", t);
    rig.T_color_depth.translation = {t[0], t[1], t[2]};
    if (!is_rotation(rig.T_color_depth.rotation)) of_color.complain("from_depth_rotation", "is no rotation (to 1e-6)");
    if (rig.registered && !(rig.color == rig.depth)) of_color.complain("width", "and the rest must be the depth camera's");
  }
  if (!complaint.empty())
    return rt::Error{rt::ExitCode::bad_input, file + ": its description of the recording is damaged: " + complaint};
  return out;
}

}  // namespace tactus::hal::record
