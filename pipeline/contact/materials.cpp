#include "pipeline/contact/materials.hpp"

#include <algorithm>
#include <span>
#include <sstream>

#include "hal/toml/toml_text.hpp"

namespace tactus::contact {
namespace {

struct Key {
  std::string_view name;
  double& (*of)(MaterialTable& table, std::size_t id);
  double least;
  double greatest;
};

template <auto kMember>
double& contact_of(MaterialTable& table, std::size_t id) {
  return table.properties[id].*kMember;
}
template <auto kMember>
double& fracture_of(MaterialTable& table, std::size_t id) {
  return table.fracture[id].*kMember;
}
template <auto kMember>
double& sound_of(MaterialTable& table, std::size_t id) {
  return table.sound[id].*kMember;
}
template <std::size_t kBand>
double& absorption_of(MaterialTable& table, std::size_t id) {
  return table.sound[id].absorption[kBand];
}
template <auto kMember>
double& look_of(MaterialTable& table, std::size_t id) {
  return table.look[id].*kMember;
}

/// The ranges are physical limits, not taste: a value outside is a slip of unit or point.
constexpr std::array kKeys = {
    Key{"restitution", contact_of<&ContactProperties::restitution>, 0, 1},
    Key{"static_friction", contact_of<&ContactProperties::static_friction>, 0, 5},
    Key{"kinetic_friction", contact_of<&ContactProperties::kinetic_friction>, 0, 5},
    Key{"rolling_resistance", contact_of<&ContactProperties::rolling_resistance>, 0, 1},
    Key{"youngs_modulus_pa", contact_of<&ContactProperties::youngs_modulus_pa>, 1e2, 2e12},
    Key{"compliance_m_per_n", contact_of<&ContactProperties::compliance_m_per_n>, 0, 0.01},
    Key{"density_kg_per_m3", contact_of<&ContactProperties::density_kg_per_m3>, 0.1, 25000},
    Key{"roughness_m", contact_of<&ContactProperties::roughness_m>, 0, 0.1},
    Key{"strength_pa", fracture_of<&FractureProperties::strength_pa>, 1e3, 1e11},
    Key{"chips_per_joule", fracture_of<&FractureProperties::chips_per_joule>, 0, 100},
    Key{"decal_radius_m", fracture_of<&FractureProperties::decal_radius_m>, 0, 0.2},
    Key{"mode_frequency_hz", sound_of<&SoundProperties::mode_frequency_hz>, 20, 20000},
    Key{"loss_factor", sound_of<&SoundProperties::loss_factor>, 1e-5, 1},
    Key{"noise_share", sound_of<&SoundProperties::noise_share>, 0, 1},
    Key{"absorption_250_hz", absorption_of<0>, 0, 1},
    Key{"absorption_1000_hz", absorption_of<1>, 0, 1},
    Key{"absorption_4000_hz", absorption_of<2>, 0, 1},
    Key{"optical_roughness", look_of<&LookProperties::optical_roughness>, 0, 1},
    Key{"metalness", look_of<&LookProperties::metalness>, 0, 1},
};

/// A key that takes one of a few words.
struct Choice {
  std::string_view name;
  std::span<const std::string_view> words;
  void (*set)(MaterialTable& table, std::size_t id, std::size_t word);
};

constexpr std::array<Choice, 2> kChoices = {{
    {"fracture_pattern", kBreakPatternNames,
     [](MaterialTable& table, std::size_t id, std::size_t word) {
       table.fracture[id].pattern = static_cast<BreakPattern>(word);
     }},
    {"decal", kDecalKindNames,
     [](MaterialTable& table, std::size_t id, std::size_t word) {
       table.fracture[id].decal = static_cast<DecalKind>(word);
     }},
}};

bool is_known(std::string_view key) {
  const auto has_name = [key](const auto& known) { return known.name == key; };
  return std::any_of(kKeys.begin(), kKeys.end(), has_name) ||
         std::any_of(kChoices.begin(), kChoices.end(), has_name);
}

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

/// Which of the choice's words stands there.
rt::Result<std::size_t> read_word(const toml::node& node, const Choice& choice, const std::string& full_name,
                                  const std::string& file) {
  const auto text = node.is_string() ? node.value<std::string>() : std::nullopt;
  std::string words;
  for (std::size_t i = 0; i < choice.words.size(); ++i) {
    if (text && *text == choice.words[i]) return i;
    words += (i == 0 ? "" : ", ") + std::string(choice.words[i]);
  }
  return complaint(file, node.source(), full_name + " must be one of " + words);
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
      if (!is_known(name.str()))
        return complaint(file, entry.source(),
                         "[" + material + "] has the unknown key \"" + std::string(name.str()) + "\"");
    }
    for (const Key& key : kKeys) {
      const std::string full_name = "[" + material + "] " + std::string(key.name);
      const toml::node* entry = entries.get(key.name);
      if (entry == nullptr) return complaint(file, node->source(), full_name + " is missing");
      const rt::Result<double> value = read_number(*entry, key, full_name, file);
      if (!value) return value.error();
      key.of(table, id) = *value;
    }
    for (const Choice& choice : kChoices) {
      const std::string full_name = "[" + material + "] " + std::string(choice.name);
      const toml::node* entry = entries.get(choice.name);
      if (entry == nullptr) return complaint(file, node->source(), full_name + " is missing");
      const rt::Result<std::size_t> word = read_word(*entry, choice, full_name, file);
      if (!word) return word.error();
      choice.set(table, id, *word);
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
