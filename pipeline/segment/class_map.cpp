#include "pipeline/segment/class_map.hpp"

#include <cmath>
#include <initializer_list>

#include "hal/toml/toml_text.hpp"

namespace tactus::segment {
namespace {

class Parser {
 public:
  explicit Parser(const std::string& file) { map_.file = file; }

  rt::Result<ClassMap> parse(std::string_view text) {
    const auto root = hal::parse_toml(text, map_.file, rt::ExitCode::bad_usage);
    if (!root) return root.error();
    read_file(*root);
    if (!what_.empty()) return rt::Error{rt::ExitCode::bad_usage, what_};
    return std::move(map_);
  }

 private:
  bool fail(std::size_t line, const std::string& key, const std::string& what) {
    if (what_.empty())
      what_ = map_.file + ":" + std::to_string(line) + ": " + (key.empty() ? "" : key + ": ") + what;
    return false;
  }
  static std::size_t line_of(const toml::node& node) { return node.source().begin.line; }

  bool only(const toml::table& table, const std::string& where,
            std::initializer_list<std::string_view> allowed) {
    for (const auto& [key, node] : table) {
      bool known = false;
      for (const std::string_view name : allowed) known = known || key.str() == name;
      if (!known) {
        std::string names;
        for (const std::string_view name : allowed) names += (names.empty() ? "" : ", ") + std::string(name);
        return fail(line_of(node), where + std::string(key.str()), "unknown key; expected one of: " + names);
      }
    }
    return true;
  }

  const toml::table* section(const toml::table& root, const char* key) {
    const toml::node* node = root.get(key);
    if (node == nullptr || !node->is_table()) {
      fail(node == nullptr ? 1 : line_of(*node), key, "the section [" + std::string(key) + "] is missing");
      return nullptr;
    }
    return node->as_table();
  }

  bool read_string(const toml::table& table, const std::string& where, const char* key, std::string& out) {
    const toml::node* node = table.get(key);
    if (node == nullptr) return fail(line_of(table), where + key, "is missing");
    if (!node->is_string()) return fail(line_of(*node), where + key, "must be a string");
    out = node->as_string()->get();
    return true;
  }

  bool read_number(const toml::node& node, const std::string& key, float low, float high, float& out) {
    const auto value = node.is_number() ? node.value<double>() : std::optional<double>();
    if (!value || !(*value >= static_cast<double>(low)) || !(*value <= static_cast<double>(high)))
      return fail(line_of(node), key,
                  "must be a number from " + std::to_string(low) + " to " + std::to_string(high));
    out = static_cast<float>(*value);
    return true;
  }

  bool read_triple(const toml::table& table, const char* key, float low, float high,
                   std::array<float, 3>& out) {
    const std::string full = std::string("input.") + key;
    const toml::node* node = table.get(key);
    if (node == nullptr) return fail(line_of(table), full, "is missing");
    const toml::array* array = node->as_array();
    if (array == nullptr || array->size() != 3) return fail(line_of(*node), full, "must be three numbers");
    for (std::size_t i = 0; i < 3; ++i)
      if (!read_number(*array->get(i), full, low, high, out[i])) return false;
    return true;
  }

  bool read_file(const toml::table& root) {
    if (!only(root, "", {"network", "input", "class"})) return false;
    const toml::table* network = section(root, "network");
    if (network == nullptr || !only(*network, "network.", {"name", "temperature"})) return false;
    if (!read_string(*network, "network.", "name", map_.network)) return false;
    if (const toml::node* t = network->get("temperature");
        t != nullptr && !read_number(*t, "network.temperature", 0.01F, 100.0F, map_.temperature))
      return false;
    const toml::table* input = section(root, "input");
    if (input == nullptr || !only(*input, "input.", {"order", "mean", "std"})) return false;
    std::string order;
    if (!read_string(*input, "input.", "order", order)) return false;
    if (order != "rgb" && order != "bgr")
      return fail(line_of(*input->get("order")), "input.order", "must be \"rgb\" or \"bgr\"");
    map_.is_bgr = order == "bgr";
    if (!read_triple(*input, "mean", -1000.0F, 1000.0F, map_.mean)) return false;
    if (!read_triple(*input, "std", 0.001F, 1000.0F, map_.std)) return false;

    const toml::node* classes = root.get("class");
    const toml::array* list = classes == nullptr ? nullptr : classes->as_array();
    if (list == nullptr || list->empty())
      return fail(classes == nullptr ? 1 : line_of(*classes), "class", "no [[class]] is given");
    for (std::size_t i = 0; i < list->size(); ++i)
      if (!read_class(*list->get(i), "class " + std::to_string(i) + ".")) return false;
    return true;
  }

  bool read_class(const toml::node& node, const std::string& where) {
    const toml::table* table = node.as_table();
    if (table == nullptr) return fail(line_of(node), where, "must be a [[class]] table");
    if (!only(*table, where, {"name", "materials"})) return false;
    std::string class_name;
    if (!read_string(*table, where, "name", class_name)) return false;
    const std::string key = where + "materials (" + class_name + ")";
    const toml::node* materials = table->get("materials");
    if (materials == nullptr) return fail(line_of(*table), key, "is missing");
    if (!materials->is_table()) return fail(line_of(*materials), key, "must be { material = share, ... }");
    MaterialDistribution distribution{};
    float sum = 0;
    for (const auto& [name, share] : *materials->as_table()) {
      const MaterialId id = material_from_name(name.str());
      if (id == kUnknownMaterial)
        return fail(line_of(share), key, "'" + std::string(name.str()) + "' is none of the 23 materials");
      if (!read_number(share, key + "." + std::string(name.str()), 0.0F, 1.0F, distribution[id]))
        return false;
      sum += distribution[id];
    }
    if (!(sum > 0.999F && sum < 1.001F))
      return fail(line_of(*materials), key, "shares sum to " + std::to_string(sum) + ", must be 1");
    for (float& share : distribution) share /= sum;
    map_.class_names.push_back(class_name);
    map_.materials.push_back(distribution);
    return true;
  }

  ClassMap map_;
  std::string what_;
};

}  // namespace

rt::Result<ClassMap> parse_class_map(std::string_view text, const std::string& file) {
  return Parser(file).parse(text);
}

rt::Result<ClassMap> load_class_map(const std::string& path) {
  const auto text = hal::read_settings_file(path, "class map");
  if (!text) return text.error();
  return parse_class_map(*text, path);
}

}  // namespace tactus::segment
