// parse_calibration_toml alone: the one file here that knows the TOML library.
#include <array>
#include <cmath>
#include <initializer_list>
#include <span>

#include "hal/replay/intrinsics_file.hpp"
#include "hal/replay/poses.hpp"
#include "hal/replay/text.hpp"
#include "hal/toml/toml_text.hpp"

namespace tactus::hal::replay {
namespace {

/// Reads keys out of one table and keeps the first complaint. A key that was not asked for is a complaint
/// too.
class TableReader {
 public:
  TableReader(const toml::table& table, std::string name, std::string_view file)
      : table_(table), name_(std::move(name)), file_(file) {}

  [[nodiscard]] const std::optional<rt::Error>& error() const { return error_; }

  const toml::node* find(std::string_view key) {
    asked_.push_back(std::string(key));
    return table_.get(key);
  }

  void number(std::string_view key, double& out) {
    const toml::node* node = find(key);
    if (node == nullptr) return complain(line(), std::string(key) + " is missing");
    const auto value = node->value<double>();
    if (!value || !node->is_number() || !std::isfinite(*value))
      return complain(line_of(*node), std::string(key) + " must be a finite number");
    out = *value;
  }

  void side(std::string_view key, int& out) {
    const toml::node* node = find(key);
    if (node == nullptr) return complain(line(), std::string(key) + " is missing");
    const auto value = node->is_integer() ? node->value<std::int64_t>() : std::nullopt;
    if (!value || *value < 1 || *value > kImageSideMax)
      return complain(line_of(*node), std::string(key) + " must be a whole number of pixels, 1 to 8192");
    out = static_cast<int>(*value);
  }

  /// Leaves `out` alone when the key is absent and may be.
  void numbers(std::string_view key, std::span<double> out, bool required) {
    const toml::node* node = find(key);
    if (node == nullptr) {
      if (required) complain(line(), std::string(key) + " is missing");
      return;
    }
    const toml::array* array = node->as_array();
    const std::string wanted =
        std::string(key) + " must be " + std::to_string(out.size()) + " finite numbers";
    if (array == nullptr || array->size() != out.size()) return complain(line_of(*node), wanted);
    for (std::size_t i = 0; i < out.size(); ++i) {
      const toml::node& item = *array->get(i);
      const auto value = item.is_number() ? item.value<double>() : std::nullopt;
      if (!value || !std::isfinite(*value)) return complain(line_of(*node), wanted);
      out[i] = *value;
    }
  }

  const toml::table* table(std::string_view key, bool required) {
    const toml::node* node = find(key);
    if (node == nullptr) {
      if (required) complain(line(), "the table [" + std::string(key) + "] is missing");
      return nullptr;
    }
    if (!node->is_table()) complain(line_of(*node), std::string(key) + " must be a table");
    return node->as_table();
  }

  void refuse_other_keys() {
    for (const auto& [key, node] : table_) {
      bool known = false;
      for (const std::string& asked : asked_) known = known || asked == key.str();
      if (!known) complain(line_of(node), quote(key.str()) + " is no key of this table");
    }
  }

  void complain(int at_line, const std::string& what) {
    if (error_) return;
    error_ = bad_input(file_, at_line, name_.empty() ? what : "[" + name_ + "] " + what);
  }

  static int line_of(const toml::node& node) { return static_cast<int>(node.source().begin.line); }

 private:
  [[nodiscard]] int line() const { return name_.empty() ? 0 : line_of(table_); }

  const toml::table& table_;
  std::string name_;
  std::string_view file_;
  std::vector<std::string> asked_;
  std::optional<rt::Error> error_;
};

void read_camera(TableReader& reader, Intrinsics& out) {
  reader.side("width", out.width);
  reader.side("height", out.height);
  reader.number("fx", out.fx);
  reader.number("fy", out.fy);
  reader.number("cx", out.cx);
  reader.number("cy", out.cy);
  std::array<double, 5> d{};
  reader.numbers("distortion", d, false);
  out.k1 = d[0];
  out.k2 = d[1];
  out.p1 = d[2];
  out.p2 = d[3];
  out.k3 = d[4];
}

std::optional<rt::Error> read_from_depth(const toml::table& table, std::string_view file, T_ColorDepth& out) {
  TableReader reader(table, "color.from_depth", file);
  reader.numbers("rotation", out.rotation.m, true);
  std::array<double, 3> t{};
  reader.numbers("translation_m", t, true);
  out.translation = {t[0], t[1], t[2]};
  reader.refuse_other_keys();
  constexpr double kTolerance = 1e-6;
  if (!is_rotation(out.rotation, kTolerance))
    reader.complain(TableReader::line_of(table), "rotation is not a rotation matrix (to 1e-6)");
  for (const double v : t)
    if (!(std::fabs(v) <= 10)) reader.complain(TableReader::line_of(table), "translation_m is beyond 10 m");
  return reader.error();
}

rt::Result<RigCalibration> read_root(const toml::table& root, std::string_view file) {
  RigCalibration out;
  TableReader reader(root, "", file);
  const toml::node* format = reader.find("format");
  if (format == nullptr || !format->is_integer() || format->value<std::int64_t>() != 1)
    reader.complain(format == nullptr ? 0 : TableReader::line_of(*format),
                    "format = 1 is what this program reads");
  const toml::node* registered = reader.find("registered");
  if (registered == nullptr || !registered->is_boolean())
    reader.complain(registered == nullptr ? 0 : TableReader::line_of(*registered),
                    "registered must be true (colour shares the depth camera) or false");
  else
    out.registered = *registered->value<bool>();
  const toml::table* depth = reader.table("depth", true);
  const toml::table* color = reader.table("color", false);
  reader.refuse_other_keys();
  if (reader.error()) return *reader.error();

  TableReader depth_reader(*depth, "depth", file);
  read_camera(depth_reader, out.depth);
  depth_reader.number("m_per_unit", out.depth_m_per_unit);
  depth_reader.refuse_other_keys();
  if (depth_reader.error()) return *depth_reader.error();
  if (!(out.depth_m_per_unit >= 1e-6 && out.depth_m_per_unit <= 1))
    return bad_input(file, TableReader::line_of(*depth), "[depth] m_per_unit must be 0.000001 to 1 metre");
  if (const std::string fault = fault_of(out.depth); !fault.empty())
    return bad_input(file, TableReader::line_of(*depth), "[depth] " + fault);

  if (out.registered) {
    if (color != nullptr)
      return bad_input(file, TableReader::line_of(*color),
                       "[color] contradicts registered = true; remove one");
    out.color = out.depth;
    return out;
  }
  if (color == nullptr) return out;
  out.has_color = true;
  TableReader color_reader(*color, "color", file);
  read_camera(color_reader, out.color);
  const toml::table* from_depth = color_reader.table("from_depth", false);
  color_reader.refuse_other_keys();
  if (color_reader.error()) return *color_reader.error();
  if (const std::string fault = fault_of(out.color); !fault.empty())
    return bad_input(file, TableReader::line_of(*color), "[color] " + fault);
  if (from_depth != nullptr)
    if (auto error = read_from_depth(*from_depth, file, out.T_color_depth)) return *error;
  return out;
}

}  // namespace

rt::Result<RigCalibration> parse_calibration_toml(std::string_view text, std::string_view file) {
  const auto root = parse_toml(text, std::string(file), rt::ExitCode::bad_input);
  if (!root) return root.error();
  return read_root(*root, file);
}

}  // namespace tactus::hal::replay
