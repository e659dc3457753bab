#include "pipeline/contact/materials.hpp"

#include <sstream>

#include "hal/toml/toml_text.hpp"

namespace tactus::contact {
namespace {

struct Key {
  std::string_view name;
  double ContactProperties::*member;
  double least;
  double greatest;
};

/// The ranges are physical limits, not taste: a value outside is a slip of unit or point.
constexpr std::array<Key, 8> kKeys = {{
    {"restitution", &ContactProperties::restitution, 0, 1},
    {"static_friction", &ContactProperties::static_friction, 0, 5},
    {"kinetic_friction", &ContactProperties::kinetic_friction, 0, 5},
    {"rolling_resistance", &ContactProperties::rolling_resistance, 0, 1},
    {"youngs_modulus_pa", &ContactProperties::youngs_modulus_pa, 1e2, 2e12},
    {"compliance_m_per_n", &ContactProperties::compliance_m_per_n, 0, 0.01},
    {"density_kg_per_m3", &ContactProperties::density_kg_per_m3, 0.1, 25000},
    {"roughness_m", &ContactProperties::roughness_m, 0, 0.1},
}};

std::string in_words(double value) {
  std::ostringstream words;
  words << value;
  return words.str();
}

rt::Error complaint(const std::string& file, const toml::source_region& where, const std::string& what) {
  return {rt::ExitCode::bad_usage, file + ":" + std::to_string(where.begin.line) + ": " + what};
}

rt::Result<double> read_number(const toml::node& node, const Key& key, const std::string& full_name,
                               const std::string& file) {
  const toml::table* entry = node.as_table();
  if (entry == nullptr)
    return complaint(file, node.source(), full_name + " must be { value = NUMBER, source = \"...\" }");
  for (const auto& [name, part] : *entry)
    if (name.str() != "value" && name.str() != "source")
      return complaint(
          file, part.source(),
          full_name + " has the unknown key \"" + std::string(name.str()) + "\"; use value and source");
  const toml::node* value_node = entry->get("value");
  const auto value =
      value_node != nullptr && value_node->is_number() ? value_node->value<double>() : std::nullopt;
  if (!value) return complaint(file, node.source(), full_name + " has no number under \"value\"");
  if (!(*value >= key.least && *value <= key.greatest))  // also refuses NaN
    return complaint(file, value_node->source(),
                     full_name + " is " + in_words(*value) + "; it must lie between " + in_words(key.least) +
                         " and " + in_words(key.greatest));
  const toml::node* source_node = entry->get("source");
  const auto source =
      source_node != nullptr && source_node->is_string() ? source_node->value<std::string>() : std::nullopt;
  if (!source || source->empty())
    return complaint(file, node.source(),
                     full_name + " has no source; name where the number comes from, or \"estimated\"");
  return *value;
}

}  // namespace

rt::Result<MaterialTable> parse_material_table(std::string_view text, const std::string& file) {
  const auto parsed = hal::parse_toml(text, file, rt::ExitCode::bad_usage);
  if (!parsed) return parsed.error();
  const toml::table& root = *parsed;

  for (const auto& [name, node] : root) {
    if (material_from_name(name.str()) == kUnknownMaterial)
      return complaint(
          file, node.source(),
          "[" + std::string(name.str()) + "] is not one of the 23 materials (brick, carpet, ... wood)");
    if (!node.is_table())
      return complaint(file, node.source(),
                       std::string(name.str()) + " must be a table: [" + std::string(name.str()) +
                           "] with its properties below");
  }

  MaterialTable table;
  for (std::size_t id = 0; id < kMaterialNames.size(); ++id) {
    const std::string material(kMaterialNames[id]);
    const toml::node* node = root.get(material);
    if (node == nullptr)
      return rt::Error{rt::ExitCode::bad_usage,
                       file + ": the material [" + material + "] is missing; a table has all 23"};
    const toml::table& entries = *node->as_table();
    for (const auto& [name, entry] : entries) {
      bool known = false;
      for (const Key& key : kKeys) known = known || key.name == name.str();
      if (!known)
        return complaint(file, entry.source(),
                         "[" + material + "] has the unknown key \"" + std::string(name.str()) + "\"");
    }
    for (const Key& key : kKeys) {
      const std::string full_name = "[" + material + "] " + std::string(key.name);
      const toml::node* entry = entries.get(key.name);
      if (entry == nullptr) return complaint(file, node->source(), full_name + " is missing");
      const rt::Result<double> value = read_number(*entry, key, full_name, file);
      if (!value) return value.error();
      table.properties[id].*key.member = *value;
    }
    if (table.properties[id].kinetic_friction > table.properties[id].static_friction)
      return complaint(
          file, entries.get("kinetic_friction")->source(),
          "[" + material + "] kinetic_friction is greater than static_friction; sliding never grips more");
  }
  return table;
}

rt::Result<MaterialTable> load_material_table(const std::string& path) {
  const auto text = hal::read_settings_file(path, "materials table");
  if (!text) return text.error();
  return parse_material_table(*text, path);
}

MaterialTable default_material_table() {
  auto table = parse_material_table(default_material_toml(), "materials.toml (built in)");
  TACTUS_ASSERT(table.has_value());
  return *table;
}

}  // namespace tactus::contact
