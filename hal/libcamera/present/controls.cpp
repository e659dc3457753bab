#include "hal/libcamera/present/controls.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <string_view>

namespace tactus::hal::libcamera {
namespace {

rt::Error bad(const lc::ControlId& id, const std::string& text, const std::string& why) {
  return {rt::ExitCode::bad_usage, "control " + id.name() + "=" + text + ": " + why + "."};
}

/// Neither the id nor its range says whether a control is a list; pipelines end the program when given the other kind.
std::size_t numbers_count(const lc::ControlId& id) {
  constexpr std::array<std::pair<std::string_view, std::size_t>, 4> kLists{
      {{"ColourGains", 2}, {"FrameDurationLimits", 2}, {"SensorBlackLevels", 4}, {"ColourCorrectionMatrix", 9}}};
  for (const auto& [name, count] : kLists)
    if (id.name() == name) return count;
  return 1;
}

std::optional<double> number_of(const lc::ControlValue& value) {
  if (value.isArray()) return std::nullopt;
  switch (value.type()) {
    case lc::ControlTypeByte:
      return value.get<std::uint8_t>();
    case lc::ControlTypeInteger32:
      return value.get<std::int32_t>();
    case lc::ControlTypeInteger64:
      return static_cast<double>(value.get<std::int64_t>());
    case lc::ControlTypeFloat:
      return static_cast<double>(value.get<float>());
    default:
      return std::nullopt;
  }
}

std::string range_of(const lc::ControlInfo& info) {
  std::string text = info.min().toString() + " to " + info.max().toString();
  if (!info.def().isNone()) text += " (" + info.def().toString() + " unless set)";
  return text;
}

std::vector<std::string> split(const std::string& text) {
  std::vector<std::string> words(1);
  for (const char c : text) {
    if (c == ',')
      words.emplace_back();
    else
      words.back() += c;
  }
  return words;
}

template <typename Number>
std::optional<Number> parse_number(const std::string& word) {
  Number value{};
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size() || word.empty()) return std::nullopt;
  if (!std::isfinite(static_cast<double>(value))) return std::nullopt;
  return value;
}

template <typename Number>
rt::Result<lc::ControlValue> parse_numbers(const lc::ControlId& id, const lc::ControlInfo& info, const std::string& text,
                                           const char* kind) {
  const std::vector<std::string> words = split(text);
  const std::size_t count = numbers_count(id);
  if (words.size() != count)
    return bad(id, text, "it takes " + std::to_string(count) + (count == 1 ? " number" : " numbers, with commas between"));
  std::vector<Number> values;
  for (const std::string& word : words) {
    const auto value = parse_number<Number>(word);
    if (!value) return bad(id, text, "it takes " + std::string(kind));
    const auto min = number_of(info.min()), max = number_of(info.max());
    const auto number = static_cast<double>(*value);
    if (min && max && (number < *min || number > *max)) return bad(id, text, "this camera takes " + range_of(info));
    values.push_back(*value);
  }
  if (count == 1) return lc::ControlValue(values.front());
  return lc::ControlValue(lc::Span<const Number>(values));
}

}  // namespace

rt::Result<lc::ControlValue> parse_control(const lc::ControlId& id, const lc::ControlInfo& info, const std::string& text) {
  switch (id.type()) {
    case lc::ControlTypeBool:
      if (text == "true" || text == "1") return lc::ControlValue(true);
      if (text == "false" || text == "0") return lc::ControlValue(false);
      return bad(id, text, "it takes true or false");
    case lc::ControlTypeByte:
      return parse_numbers<std::uint8_t>(id, info, text, "a whole number from 0 to 255");
    case lc::ControlTypeInteger32:
      return parse_numbers<std::int32_t>(id, info, text, "a whole number");
    case lc::ControlTypeInteger64:
      return parse_numbers<std::int64_t>(id, info, text, "a whole number");
    case lc::ControlTypeFloat:
      return parse_numbers<float>(id, info, text, "a number");
    default:
      return bad(id, text, "only numbers and true or false can be set");
  }
}

rt::Result<std::vector<ControlSetting>> parse_controls(const lc::ControlInfoMap& offered,
                                                       std::span<const std::pair<std::string, std::string>> wanted) {
  std::vector<ControlSetting> settings;
  for (const auto& [name, text] : wanted) {
    auto found = offered.begin();
    while (found != offered.end() && found->first->name() != name) ++found;
    if (found == offered.end()) {
      std::vector<std::string> names;
      for (const auto& [id, info] : offered) names.push_back(id->name() + " " + info.toString());
      std::sort(names.begin(), names.end());
      std::string list;
      for (const std::string& entry : names) list += (list.empty() ? "" : ", ") + entry;
      return rt::Error{rt::ExitCode::bad_usage, "control " + name + ": this camera has none of that name; it has " +
                                                    (list.empty() ? "no controls at all" : list) + "."};
    }
    auto value = parse_control(*found->first, found->second, text);
    if (!value) return value.error();
    settings.push_back({found->first->id(), *value});
  }
  return settings;
}

}  // namespace tactus::hal::libcamera
