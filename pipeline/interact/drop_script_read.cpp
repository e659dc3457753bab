#include <array>
#include <cmath>
#include <sstream>

#include "hal/toml/toml_text.hpp"
#include "pipeline/interact/drop_script.hpp"

namespace tactus::interact {
namespace {

constexpr std::array<std::string_view, 11> kKeys = {
    "at_s",       "at_frame",   "shape",           "radius_m",         "size_m",       "material",
    "position_m", "in_front_m", "above_surface_m", "velocity_m_per_s", "speed_m_per_s"};

/// Reads the keys of one [[throw]]; the first complaint stays.
class ThrowReader {
 public:
  ThrowReader(const toml::table& table, const std::string& file) : table_(table), file_(file) {}

  void complain(const toml::node& where, const std::string& what) {
    if (!error_)
      error_ = rt::Error{rt::ExitCode::bad_usage,
                         file_ + ":" + std::to_string(where.source().begin.line) + ": [[throw]] " + what};
  }
  [[nodiscard]] const toml::node* find(std::string_view key) const { return table_.get(key); }
  [[nodiscard]] bool has(std::string_view key) const { return find(key) != nullptr; }
  [[nodiscard]] const toml::table& table() const { return table_; }
  [[nodiscard]] const std::optional<rt::Error>& error() const { return error_; }

  std::optional<double> number(std::string_view key, double least, double greatest) {
    const toml::node* node = find(key);
    if (node == nullptr) return std::nullopt;
    return checked(*node, std::string(key), least, greatest);
  }
  std::optional<Vec3d> vector(std::string_view key, double least, double greatest) {
    const toml::node* node = find(key);
    if (node == nullptr) return std::nullopt;
    const toml::array* array = node->as_array();
    if (array == nullptr || array->size() != 3) {
      complain(*node, std::string(key) + " must be three numbers: [x, y, z]");
      return std::nullopt;
    }
    std::array<double, 3> v{};
    for (std::size_t i = 0; i < 3; ++i)
      v[i] = checked(*array->get(i), std::string(key) + "[" + std::to_string(i) + "]", least, greatest)
                 .value_or(0);
    return Vec3d{v[0], v[1], v[2]};
  }
  std::optional<std::string> text(std::string_view key) {
    const toml::node* node = find(key);
    if (node == nullptr) return std::nullopt;
    if (!node->is_string()) {
      complain(*node, std::string(key) + " must be a text in quotes");
      return std::nullopt;
    }
    return node->value<std::string>();
  }

 private:
  std::optional<double> checked(const toml::node& node, const std::string& name, double least,
                                double greatest) {
    if (!node.is_number()) {
      complain(node, name + " must be a number");
      return std::nullopt;
    }
    const double value = *node.value<double>();
    if (value >= least && value <= greatest) return value;
    std::ostringstream words;
    words << name << " is " << value << "; it must lie between " << least << " and " << greatest;
    complain(node, words.str());
    return std::nullopt;
  }

  const toml::table& table_;
  const std::string& file_;
  std::optional<rt::Error> error_;
};

void read_time(ThrowReader& reader, Throw& what) {
  if (reader.has("at_s") == reader.has("at_frame")) {
    reader.complain(reader.table(), "needs exactly one of at_s and at_frame");
    return;
  }
  if (const auto seconds = reader.number("at_s", 0, 86400))
    what.at_time = rt::Duration{static_cast<std::int64_t>(*seconds * 1e9)};
  if (const auto frame = reader.number("at_frame", 0, 1e9)) {
    if (!reader.find("at_frame")->is_integer())
      reader.complain(*reader.find("at_frame"), "at_frame must be a whole number");
    what.at_frame = static_cast<std::uint64_t>(*frame);
  }
}

void read_shape(ThrowReader& reader, Throw& what) {
  const std::string shape = reader.text("shape").value_or("sphere");
  if (shape == "sphere") {
    if (reader.has("size_m")) reader.complain(*reader.find("size_m"), "a sphere has radius_m, not size_m");
    what.shape = contact::Shape::sphere(reader.number("radius_m", 0.002, 1).value_or(0.05));
  } else if (shape == "box") {
    if (reader.has("radius_m")) reader.complain(*reader.find("radius_m"), "a box has size_m, not radius_m");
    what.shape = contact::Shape::box(reader.vector("size_m", 0.004, 2).value_or(Vec3d{0.1, 0.1, 0.1}) * 0.5);
  } else {
    reader.complain(*reader.find("shape"), "shape is \"" + shape + "\"; it must be \"sphere\" or \"box\"");
  }
  if (const auto material = reader.text("material")) {
    what.material = material_from_name(*material);
    if (what.material == kUnknownMaterial)
      reader.complain(*reader.find("material"),
                      "material \"" + *material + "\" is not one of the 23 (brick, carpet, ... wood)");
  }
}

void read_place(ThrowReader& reader, Throw& what) {
  what.position_world_m = reader.vector("position_m", -1000, 1000);
  if (reader.has("position_m") && reader.has("in_front_m"))
    reader.complain(*reader.find("in_front_m"), "has both position_m and in_front_m; keep one");
  if (reader.has("position_m") && reader.has("above_surface_m"))
    reader.complain(*reader.find("above_surface_m"),
                    "above_surface_m goes with in_front_m, not with position_m");
  what.in_front_m = reader.number("in_front_m", 0.05, 20).value_or(0.8);
  what.above_surface_m = reader.number("above_surface_m", 0, 5);
  what.velocity_world_m_per_s = reader.vector("velocity_m_per_s", -200, 200).value_or(Vec3d{});
  what.speed_m_per_s = reader.number("speed_m_per_s", 0, 200).value_or(0);
}

}  // namespace

rt::Result<std::vector<Throw>> parse_drop_script(std::string_view text, const std::string& file) {
  const auto parsed = hal::parse_toml(text, file, rt::ExitCode::bad_usage);
  if (!parsed) return parsed.error();
  const auto complaint = [&file](const toml::source_region& where, const std::string& what) {
    return rt::Error{rt::ExitCode::bad_usage, file + ":" + std::to_string(where.begin.line) + ": " + what};
  };
  for (const auto& [name, node] : *parsed)
    if (name.str() != "throw")
      return complaint(node.source(),
                       "unknown key \"" + std::string(name.str()) + "\"; a script has [[throw]] entries");
  const toml::node* node = parsed->get("throw");
  if (node == nullptr) return rt::Error{rt::ExitCode::bad_usage, file + ": the script has no [[throw]]"};
  const toml::array* entries = node->as_array();
  if (entries == nullptr) return complaint(node->source(), "write [[throw]] with two brackets");
  if (entries->size() > kThrowsMax)
    return complaint(node->source(), "more than " + std::to_string(kThrowsMax) + " throws in one script");

  std::vector<Throw> throws;
  for (const toml::node& entry : *entries) {
    const toml::table* table = entry.as_table();
    if (table == nullptr)
      return complaint(entry.source(), "throw must be a table: [[throw]] with its keys below");
    ThrowReader reader(*table, file);
    for (const auto& [name, value] : *table) {
      bool known = false;
      for (const std::string_view key : kKeys) known = known || key == name.str();
      if (!known) reader.complain(value, "has the unknown key \"" + std::string(name.str()) + "\"");
    }
    Throw what;
    read_time(reader, what);
    read_shape(reader, what);
    read_place(reader, what);
    if (reader.error()) return *reader.error();
    throws.push_back(what);
  }
  return throws;
}

rt::Result<std::vector<Throw>> load_drop_script(const std::string& path) {
  const auto text = hal::read_settings_file(path, "script");
  if (!text) return text.error();
  return parse_drop_script(*text, path);
}

}  // namespace tactus::interact
