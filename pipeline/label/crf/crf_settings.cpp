#include "pipeline/label/crf/crf_settings.hpp"

#include <array>
#include <charconv>
#include <initializer_list>
#include <optional>
#include <vector>

#include "hal/toml/toml_text.hpp"

namespace tactus::label {
namespace {

std::string number(float value) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  std::string shortest(text.data(), end);
  if (shortest.find_first_of(".en") == std::string::npos) shortest += ".0";
  return shortest;
}

class Parser {
 public:
  explicit Parser(const std::string& file) : file_(file) {}

  rt::Result<CrfParameters> parse(std::string_view text) {
    const auto root = hal::parse_toml(text, file_, rt::ExitCode::bad_usage);
    if (!root) return root.error();
    if (!read_file(*root)) return rt::Error{rt::ExitCode::bad_usage, what_};
    return parameters_;
  }

 private:
  bool fail(std::size_t line, const std::string& key, const std::string& what) {
    what_ = file_ + ":" + std::to_string(line) + ": " + key + ": " + what;
    return false;
  }
  static std::size_t line_of(const toml::node& node) { return node.source().begin.line; }

  bool only(const toml::table& table, const std::string& where,
            std::initializer_list<std::string_view> allowed) {
    for (const auto& [key, node] : table) {
      bool known = false;
      for (const std::string_view name : allowed) known = known || key.str() == name;
      if (known) continue;
      std::string names;
      for (const std::string_view name : allowed) names += (names.empty() ? "" : ", ") + std::string(name);
      return fail(line_of(node), where + std::string(key.str()), "unknown key; expected one of: " + names);
    }
    return true;
  }

  // Each reader leaves the value as it is when the key is missing.
  bool read_number(const toml::table& table, const std::string& where, const char* key, float low, float high,
                   float& out) {
    const toml::node* node = table.get(key);
    if (node == nullptr) return true;
    const auto value = node->is_number() ? node->value<double>() : std::optional<double>();
    if (!value || !(*value >= static_cast<double>(low)) || !(*value <= static_cast<double>(high)))
      return fail(line_of(*node), where + key,
                  "must be a number from " + number(low) + " to " + number(high));
    out = static_cast<float>(*value);
    return true;
  }

  bool read_choice(const toml::table& table, const char* key, std::string_view first, std::string_view second,
                   bool& is_second) {
    const toml::node* node = table.get(key);
    if (node == nullptr) return true;
    const std::string value = node->is_string() ? node->as_string()->get() : "";
    if (value != first && value != second)
      return fail(line_of(*node), key,
                  "must be \"" + std::string(first) + "\" or \"" + std::string(second) + "\"");
    is_second = value == second;
    return true;
  }

  // False with what_ empty when there is no such section.
  const toml::table* section(const toml::table& root, const char* key) {
    const toml::node* node = root.get(key);
    if (node == nullptr) return nullptr;
    if (node->is_table()) return node->as_table();
    fail(line_of(*node), key, "must be a section [" + std::string(key) + "]");
    return nullptr;
  }

  bool read_kernel(const toml::table& root, const char* name, float& weight, float& theta_position_m,
                   const char* second_key, float* second_theta) {
    const toml::table* table = section(root, name);
    if (table == nullptr) return what_.empty();
    const std::string where = std::string(name) + ".";
    constexpr float kThetaLeast = 1e-4F, kThetaMost = 1e4F;
    if (second_theta == nullptr) {
      if (!only(*table, where, {"weight", "theta_position_m"})) return false;
    } else {
      if (!only(*table, where, {"weight", "theta_position_m", second_key})) return false;
      if (!read_number(*table, where, second_key, kThetaLeast, kThetaMost, *second_theta)) return false;
    }
    return read_number(*table, where, "weight", 0, 1000, weight) &&
           read_number(*table, where, "theta_position_m", kThetaLeast, kThetaMost, theta_position_m);
  }

  bool read_file(const toml::table& root) {
    if (!only(root, "",
              {"preset", "iterations_max", "settled_change", "normalisation", "smoothness", "appearance",
               "surface", "compatibility"}))
      return false;
    bool is_paper = false;
    if (!read_choice(root, "preset", "default", "paper", is_paper)) return false;
    parameters_ = is_paper ? paper_crf_parameters() : default_crf_parameters();
    if (const toml::node* node = root.get("iterations_max"); node != nullptr) {
      const auto value = node->is_integer() ? node->value<std::int64_t>() : std::optional<std::int64_t>();
      if (!value || *value < 0 || *value > 1000)
        return fail(line_of(*node), "iterations_max", "must be a whole number from 0 to 1000");
      parameters_.iterations_max = static_cast<int>(*value);
    }
    if (!read_number(root, "", "settled_change", 0, 1, parameters_.settled_change)) return false;
    bool is_per_point = parameters_.normalisation == CrfNormalisation::per_point;
    if (!read_choice(root, "normalisation", "symmetric", "per_point", is_per_point)) return false;
    parameters_.normalisation = is_per_point ? CrfNormalisation::per_point : CrfNormalisation::symmetric;
    auto& p = parameters_;
    return read_kernel(root, "smoothness", p.smoothness.weight, p.smoothness.theta_position_m, "", nullptr) &&
           read_kernel(root, "appearance", p.appearance.weight, p.appearance.theta_position_m, "theta_color",
                       &p.appearance.theta_color) &&
           read_kernel(root, "surface", p.surface.weight, p.surface.theta_position_m, "theta_normal",
                       &p.surface.theta_normal) &&
           read_compatibility(root);
  }

  bool read_compatibility(const toml::table& root) {
    const toml::table* table = section(root, "compatibility");
    if (table == nullptr) return what_.empty();
    if (!only(*table, "compatibility.", {"default_cost", "pair"})) return false;
    float default_cost = 1;
    if (!read_number(*table, "compatibility.", "default_cost", -100, 100, default_cost)) return false;
    CrfCompatibility& mu = parameters_.compatibility;
    mu.is_potts = false;
    for (std::size_t a = 0; a < kMaterialCount; ++a)
      for (std::size_t b = 0; b < kMaterialCount; ++b)
        mu.cost[a * kMaterialCount + b] = a == b ? 0 : default_cost;
    const toml::node* pairs = table->get("pair");
    if (pairs == nullptr) return true;
    if (!pairs->is_array())
      return fail(line_of(*pairs), "compatibility.pair", "must be [[compatibility.pair]] tables");
    std::vector<bool> is_given(std::size_t{kMaterialCount} * kMaterialCount);
    for (const toml::node& node : *pairs->as_array())
      if (!read_pair(node, is_given)) return false;
    return true;
  }

  bool read_pair(const toml::node& node, std::vector<bool>& is_given) {
    const std::string where = "compatibility.pair.";
    const toml::table* table = node.as_table();
    if (table == nullptr)
      return fail(line_of(node), "compatibility.pair", "must be a [[compatibility.pair]] table");
    if (!only(*table, where, {"materials", "cost"})) return false;
    const toml::node* materials = table->get("materials");
    const toml::array* names = materials == nullptr ? nullptr : materials->as_array();
    const std::size_t line = materials == nullptr ? line_of(*table) : line_of(*materials);
    if (names == nullptr || names->size() != 2)
      return fail(line, where + "materials", "must be two material names");
    std::array<MaterialId, 2> ids{};
    for (std::size_t i = 0; i < 2; ++i) {
      const toml::node& name = *names->get(i);
      ids[i] = name.is_string() ? material_from_name(name.as_string()->get()) : kUnknownMaterial;
      if (ids[i] == kUnknownMaterial)
        return fail(line_of(name), where + "materials", "must be two names of the 23 materials");
    }
    if (ids[0] == ids[1]) return fail(line, where + "materials", "a material costs nothing beside itself");
    const std::size_t at = ids[0] * std::size_t{kMaterialCount} + ids[1],
                      mirrored = ids[1] * std::size_t{kMaterialCount} + ids[0];
    if (is_given[at]) return fail(line, where + "materials", "this pair was given before");
    is_given[at] = is_given[mirrored] = true;
    if (table->get("cost") == nullptr) return fail(line_of(*table), where + "cost", "is missing");
    float cost = 0;
    if (!read_number(*table, where, "cost", -100, 100, cost)) return false;
    parameters_.compatibility.cost[at] = parameters_.compatibility.cost[mirrored] = cost;
    return true;
  }

  const std::string& file_;
  CrfParameters parameters_{};
  std::string what_;
};

}  // namespace

rt::Result<CrfParameters> parse_crf_parameters(std::string_view text, const std::string& file) {
  return Parser(file).parse(text);
}

rt::Result<CrfParameters> load_crf_parameters(const std::string& path) {
  const auto text = hal::read_settings_file(path, "CRF settings");
  if (!text) return text.error();
  return parse_crf_parameters(*text, path);
}

std::string format_crf_parameters(const CrfParameters& p) {
  std::string text = "iterations_max = " + std::to_string(p.iterations_max) +
                     "\nsettled_change = " + number(p.settled_change) + "\nnormalisation = \"" +
                     (p.normalisation == CrfNormalisation::symmetric ? "symmetric" : "per_point") +
                     "\"\n[smoothness]\nweight = " + number(p.smoothness.weight) +
                     "\ntheta_position_m = " + number(p.smoothness.theta_position_m) +
                     "\n[appearance]\nweight = " + number(p.appearance.weight) +
                     "\ntheta_position_m = " + number(p.appearance.theta_position_m) +
                     "\ntheta_color = " + number(p.appearance.theta_color) +
                     "\n[surface]\nweight = " + number(p.surface.weight) +
                     "\ntheta_position_m = " + number(p.surface.theta_position_m) +
                     "\ntheta_normal = " + number(p.surface.theta_normal) + "\n";
  if (p.compatibility.is_potts) return text;
  text += "[compatibility]\n";
  for (std::size_t a = 0; a < kMaterialCount; ++a)
    for (std::size_t b = a + 1; b < kMaterialCount; ++b)
      if (p.compatibility.of(a, b) != 1)
        text += "[[compatibility.pair]]\nmaterials = [\"" + std::string(kMaterialNames[a]) + "\", \"" +
                std::string(kMaterialNames[b]) + "\"]\ncost = " + number(p.compatibility.of(a, b)) + "\n";
  return text;
}

}  // namespace tactus::label
