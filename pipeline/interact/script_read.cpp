// Scripts from TOML, key by key.
#include <array>
#include <cmath>
#include <span>
#include <sstream>

#include "hal/toml/toml_text.hpp"
#include "pipeline/interact/script.hpp"

namespace tactus::interact {
namespace {

constexpr std::array<std::string_view, 16> kThrowKeys = {
    "at_s",     "at_frame",   "thing",           "shape",  "radius_m", "size_m",        "length_m",         "material",
    "position_m", "in_front_m", "above_surface_m", "aim_px", "target_m", "speed_m_per_s", "velocity_m_per_s", "spin_rad_per_s"};
constexpr std::array<std::string_view, 6> kShotKeys = {"at_s",     "at_frame", "aim_px",
                                                       "target_m", "energy_j", "projectile_m_per_s"};
constexpr std::array<std::string_view, 6> kWalkerKeys = {"at_s", "at_frame", "position_m", "in_front_m", "goal_m", "wander"};

/// Reads the keys of one entry; the first complaint stays.
class EntryReader {
 public:
  EntryReader(const toml::table& table, std::string_view kind, const std::string& file)
      : table_(table), kind_(kind), file_(file) {}

  void complain(const toml::node& where, const std::string& what) {
    if (!error_)
      error_ = rt::Error{rt::ExitCode::bad_usage, file_ + ":" + std::to_string(where.source().begin.line) + ": [[" +
                                                      std::string(kind_) + "]] " + what};
  }
  void complain(std::string_view key, const std::string& what) { complain(*find(key), what); }
  [[nodiscard]] const toml::node* find(std::string_view key) const { return table_.get(key); }
  [[nodiscard]] bool has(std::string_view key) const { return find(key) != nullptr; }
  [[nodiscard]] const toml::table& table() const { return table_; }
  [[nodiscard]] const std::optional<rt::Error>& error() const { return error_; }

  void refuse_unknown(std::span<const std::string_view> known_keys) {
    for (const auto& [name, value] : table_) {
      bool known = false;
      for (const std::string_view key : known_keys) known = known || key == name.str();
      if (!known) complain(value, "has the unknown key \"" + std::string(name.str()) + "\"");
    }
  }
  std::optional<double> number(std::string_view key, double least, double greatest) {
    const toml::node* node = find(key);
    if (node == nullptr) return std::nullopt;
    return checked(*node, std::string(key), least, greatest);
  }
  template <std::size_t kCount>
  std::optional<std::array<double, kCount>> numbers(std::string_view key, double least, double greatest,
                                                    const char* form) {
    const toml::node* node = find(key);
    if (node == nullptr) return std::nullopt;
    const toml::array* array = node->as_array();
    if (array == nullptr || array->size() != kCount) {
      complain(*node, std::string(key) + " must be " + form);
      return std::nullopt;
    }
    std::array<double, kCount> values{};
    for (std::size_t i = 0; i < kCount; ++i)
      values[i] = checked(*array->get(i), std::string(key) + "[" + std::to_string(i) + "]", least, greatest)
                      .value_or(0);
    return values;
  }
  std::optional<Vec3d> vector(std::string_view key, double least, double greatest) {
    const auto v = numbers<3>(key, least, greatest, "three numbers: [x, y, z]");
    if (!v) return std::nullopt;
    return Vec3d{(*v)[0], (*v)[1], (*v)[2]};
  }
  std::optional<std::uint64_t> whole(std::string_view key, double greatest) {
    const auto value = number(key, 0, greatest);
    if (!value) return std::nullopt;
    if (!find(key)->is_integer()) complain(key, std::string(key) + " must be a whole number");
    return static_cast<std::uint64_t>(*value);
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
  std::string_view kind_;
  const std::string& file_;
  std::optional<rt::Error> error_;
};

Moment read_moment(EntryReader& reader) {
  Moment when;
  if (reader.has("at_s") == reader.has("at_frame")) {
    reader.complain(reader.table(), "needs exactly one of at_s and at_frame");
    return when;
  }
  if (const auto seconds = reader.number("at_s", 0, 86400))
    when.at_time = rt::Duration{static_cast<std::int64_t>(*seconds * 1e9)};
  when.at_frame = reader.whole("at_frame", 1e9);
  return when;
}

Aim read_aim(EntryReader& reader) {
  Aim aim;
  aim.pixel = reader.numbers<2>("aim_px", 0, 8192, "two numbers: [u, v]");
  aim.target_world_m = reader.vector("target_m", -1000, 1000);
  if (aim.pixel && aim.target_world_m) reader.complain("target_m", "has both aim_px and target_m; keep one");
  return aim;
}

/// A measure of a shape: there when the shape has it, refused when it does not.
double measure(EntryReader& reader, const std::string& shape, std::string_view key, bool belongs, double least,
               double greatest, double otherwise) {
  if (reader.has(key) && !belongs)
    reader.complain(key, std::string(key) + " is no measure of a " + shape + "; a sphere has radius_m, a box size_m, a "
                             "capsule and a cylinder radius_m and length_m");
  return reader.number(key, least, greatest).value_or(otherwise);
}

void read_shape(EntryReader& reader, Throw& what) {
  if (const auto thing = reader.text("thing")) {
    bool is_known = false;
    for (std::size_t i = 1; i < kThingsCount; ++i)
      if (*thing == kThingNames[i]) {
        what.thing = static_cast<ThingKind>(i);
        is_known = true;
      }
    if (!is_known) reader.complain("thing", "thing is \"" + *thing + "\"; it must be \"plate\" or \"cup\"");
    for (const std::string_view key : {"shape", "radius_m", "size_m", "length_m", "material"})
      if (reader.has(key))
        reader.complain(key, std::string(key) + " goes with a plain shape, not with thing = \"" + *thing + "\"");
    return;
  }
  const std::string shape = reader.text("shape").value_or("sphere");
  const bool is_long = shape == "capsule" || shape == "cylinder";
  const double radius = measure(reader, shape, "radius_m", shape == "sphere" || is_long, 0.002, 1, 0.05);
  const double length = measure(reader, shape, "length_m", is_long, 0.004, 2, 0.1);
  if (reader.has("size_m") && shape != "box")
    reader.complain("size_m", "a " + shape + " has radius_m, not size_m");
  if (shape == "sphere") {
    what.shape = contact::Shape::sphere(radius);
  } else if (shape == "box") {
    what.shape = contact::Shape::box(reader.vector("size_m", 0.004, 2).value_or(Vec3d{0.1, 0.1, 0.1}) * 0.5);
  } else if (shape == "capsule") {
    what.shape = contact::Shape::capsule(radius, length / 2);
  } else if (shape == "cylinder") {
    what.shape = contact::Shape::cylinder(radius, length / 2);
  } else {
    reader.complain("shape", "shape is \"" + shape + "\"; it must be \"sphere\", \"box\", \"capsule\" or \"cylinder\"");
  }
  if (const auto material = reader.text("material")) {
    what.material = material_from_name(*material);
    if (what.material == kUnknownMaterial)
      reader.complain("material", "material \"" + *material + "\" is not one of the 23 (brick, carpet, ... wood)");
  }
}

void read_place(EntryReader& reader, Throw& what) {
  what.position_world_m = reader.vector("position_m", -1000, 1000);
  if (reader.has("position_m") && reader.has("in_front_m"))
    reader.complain("in_front_m", "has both position_m and in_front_m; keep one");
  if (reader.has("position_m") && reader.has("above_surface_m"))
    reader.complain("above_surface_m", "above_surface_m goes with in_front_m, not with position_m");
  what.aim = read_aim(reader);
  if (what.aim.is_set() && reader.has("above_surface_m"))
    reader.complain("above_surface_m", "above_surface_m drops a thing and aim_px or target_m throws it; keep one");
  what.in_front_m = reader.number("in_front_m", 0.05, 20).value_or(what.aim.is_set() ? 0.3 : 0.8);
  what.above_surface_m = reader.number("above_surface_m", 0, 5);
  what.velocity_world_m_per_s = reader.vector("velocity_m_per_s", -200, 200).value_or(Vec3d{});
  what.spin_world_rad_per_s = reader.vector("spin_rad_per_s", -200, 200).value_or(Vec3d{});
  what.speed_m_per_s = reader.number("speed_m_per_s", 0, 200).value_or(what.aim.is_set() ? 5 : 0);
  if (what.aim.is_set() && what.speed_m_per_s < 0.5)
    reader.complain("speed_m_per_s", "a throw at a target needs speed_m_per_s of at least 0.5");
}

Throw read_throw(EntryReader& reader) {
  Throw what;
  reader.refuse_unknown(kThrowKeys);
  what.when = read_moment(reader);
  read_shape(reader, what);
  read_place(reader, what);
  return what;
}

Shot read_shot(EntryReader& reader) {
  Shot shot;
  reader.refuse_unknown(kShotKeys);
  shot.when = read_moment(reader);
  shot.aim = read_aim(reader);
  shot.energy_j = reader.number("energy_j", 0.01, 10000).value_or(shot.energy_j);
  shot.projectile_m_per_s = reader.number("projectile_m_per_s", 1, 1000).value_or(0);
  return shot;
}

Walker read_walker(EntryReader& reader) {
  Walker walker;
  reader.refuse_unknown(kWalkerKeys);
  walker.when = read_moment(reader);
  walker.position_world_m = reader.vector("position_m", -1000, 1000);
  if (reader.has("position_m") && reader.has("in_front_m"))
    reader.complain("in_front_m", "has both position_m and in_front_m; keep one");
  walker.in_front_m = reader.number("in_front_m", 0, 20).value_or(walker.in_front_m);
  walker.goal_world_m = reader.vector("goal_m", -1000, 1000);
  if (reader.has("goal_m") && reader.has("wander")) reader.complain("wander", "has both goal_m and wander; keep one");
  walker.wander_seed = reader.whole("wander", 1e9).value_or(walker.wander_seed);
  return walker;
}

rt::Error complaint(const std::string& file, const toml::source_region& where, const std::string& what) {
  return {rt::ExitCode::bad_usage, file + ":" + std::to_string(where.begin.line) + ": " + what};
}

/// All entries of one kind; none when the script has none.
template <typename Entry>
rt::Result<std::vector<Entry>> read_entries(const toml::table& script, std::string_view kind, const std::string& file,
                                            std::size_t entries_max, Entry (*read)(EntryReader&)) {
  std::vector<Entry> entries;
  const toml::node* node = script.get(kind);
  if (node == nullptr) return entries;
  const toml::array* array = node->as_array();
  const std::string name(kind);
  if (array == nullptr) return complaint(file, node->source(), "write [[" + name + "]] with two brackets");
  if (array->size() > entries_max)
    return complaint(file, node->source(), "more than " + std::to_string(entries_max) + " entries [[" + name + "]] in one script");
  for (const toml::node& entry : *array) {
    const toml::table* table = entry.as_table();
    if (table == nullptr)
      return complaint(file, entry.source(), name + " must be a table: [[" + name + "]] with its keys below");
    EntryReader reader(*table, kind, file);
    const Entry one = read(reader);
    if (reader.error()) return *reader.error();
    entries.push_back(one);
  }
  return entries;
}

}  // namespace

rt::Result<Script> parse_script(std::string_view text, const std::string& file) {
  const auto parsed = hal::parse_toml(text, file, rt::ExitCode::bad_usage);
  if (!parsed) return parsed.error();
  for (const auto& [name, node] : *parsed)
    if (name.str() != "throw" && name.str() != "shot" && name.str() != "walker")
      return complaint(file, node.source(), "unknown key \"" + std::string(name.str()) +
                                                "\"; a script has [[throw]], [[shot]] and [[walker]] entries");
  auto throws = read_entries<Throw>(*parsed, "throw", file, kEntriesMax, read_throw);
  if (!throws) return throws.error();
  auto shots = read_entries<Shot>(*parsed, "shot", file, kEntriesMax, read_shot);
  if (!shots) return shots.error();
  auto walkers = read_entries<Walker>(*parsed, "walker", file, kWalkersMax, read_walker);
  if (!walkers) return walkers.error();
  if (throws->empty() && shots->empty() && walkers->empty())
    return rt::Error{rt::ExitCode::bad_usage, file + ": the script has no [[throw]], no [[shot]] and no [[walker]]"};
  return Script{std::move(*throws), std::move(*shots), std::move(*walkers)};
}

rt::Result<Script> load_script(const std::string& path) {
  const auto text = hal::read_settings_file(path, "script");
  if (!text) return text.error();
  return parse_script(*text, path);
}

}  // namespace tactus::interact
