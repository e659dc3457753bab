#include "hal/v4l2/controls.hpp"

#include <linux/videodev2.h>

#include <algorithm>
#include <charconv>
#include <cstring>
#include <optional>

#include "hal/v4l2/node.hpp"

namespace tactus::hal::v4l2 {
namespace {

using Kind = ControlInfo::Kind;

bool is_letter_or_digit(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9'); }

std::optional<std::int64_t> parse_number(std::string_view text) {
  std::int64_t sign = 1;
  if (text.starts_with('-')) {
    sign = -1;
    text.remove_prefix(1);
  }
  int base = 10;
  if (text.starts_with("0x") || text.starts_with("0X")) {
    base = 16;
    text.remove_prefix(2);
  }
  std::int64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number, base);
  if (text.starts_with('-') || error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return sign * number;
}

std::string item_text(const MenuItem& item) { return std::to_string(item.index) + " (" + item.label + ")"; }

std::string list(const std::vector<std::string>& items) {
  std::string out;
  for (const std::string& item : items) out += (out.empty() ? "" : ", ") + item;
  return out.empty() ? "none" : out;
}

rt::Error refusal(std::string message) { return {rt::ExitCode::bad_usage, std::move(message)}; }

std::string range_text(const ControlInfo& control) {
  std::string text = std::to_string(control.min) + " to " + std::to_string(control.max);
  if (control.step > 1) text += " in steps of " + std::to_string(control.step);
  return text;
}

/// The item that `text` names by number or label; label compared as names are, so that case and punctuation are free.
std::optional<std::int64_t> find_item(const ControlInfo& control, std::string_view text) {
  const auto number = parse_number(text);
  for (const MenuItem& item : control.menu)
    if (number && item.index == *number) return item.index;
  const std::string name = control_name(text);
  for (const MenuItem& item : control.menu)
    if (!name.empty() && control_name(item.label) == name) return item.index;
  return std::nullopt;
}

std::optional<std::int64_t> parse_switch(std::string_view text) {
  const std::string word = control_name(text);
  if (word == "1" || word == "on" || word == "true" || word == "yes") return 1;
  if (word == "0" || word == "off" || word == "false" || word == "no") return 0;
  return std::nullopt;
}

Kind kind_of(const v4l2_query_ext_ctrl& control) {
  if (control.nr_of_dims > 0) return Kind::other;
  switch (control.type) {
    case V4L2_CTRL_TYPE_INTEGER:
    case V4L2_CTRL_TYPE_INTEGER64:
    case V4L2_CTRL_TYPE_BITMASK:
      return Kind::integer;
    case V4L2_CTRL_TYPE_BOOLEAN:
      return Kind::boolean;
    case V4L2_CTRL_TYPE_MENU:
    case V4L2_CTRL_TYPE_INTEGER_MENU:
      return Kind::menu;
    case V4L2_CTRL_TYPE_BUTTON:
      return Kind::button;
    default:
      return Kind::other;
  }
}

std::vector<MenuItem> read_menu(int fd, const v4l2_query_ext_ctrl& control) {
  constexpr std::int64_t kItemsMax = 256;
  std::vector<MenuItem> items;
  for (std::int64_t i = control.minimum; i <= control.maximum && i - control.minimum < kItemsMax; ++i) {
    v4l2_querymenu item{};
    item.id = control.id;
    item.index = static_cast<std::uint32_t>(i);
    if (call(fd, VIDIOC_QUERYMENU, &item) != 0) continue;  // menus have holes
    if (control.type == V4L2_CTRL_TYPE_INTEGER_MENU) {
      items.push_back({i, std::to_string(item.value)});
      continue;
    }
    const auto* label = reinterpret_cast<const char*>(item.name);
    items.push_back({i, std::string(label, ::strnlen(label, sizeof item.name))});
  }
  return items;
}

ControlInfo info_of(int fd, const v4l2_query_ext_ctrl& control) {
  ControlInfo info;
  info.id = control.id;
  info.name = control_name({control.name, ::strnlen(control.name, sizeof control.name)});
  info.kind = kind_of(control);
  info.is_64_bit = control.type == V4L2_CTRL_TYPE_INTEGER64;
  info.is_read_only = (control.flags & (V4L2_CTRL_FLAG_READ_ONLY | V4L2_CTRL_FLAG_GRABBED)) != 0;
  info.is_inactive = (control.flags & V4L2_CTRL_FLAG_INACTIVE) != 0;
  info.min = control.minimum;
  // A bit mask's maximum is the set of its bits.
  info.max = control.type == V4L2_CTRL_TYPE_BITMASK ? static_cast<std::int64_t>(static_cast<std::uint32_t>(control.maximum))
                                                    : control.maximum;
  info.step = static_cast<std::int64_t>(control.step);
  if (info.kind == Kind::menu) info.menu = read_menu(fd, control);
  return info;
}

}  // namespace

std::string control_name(std::string_view driver_name) {
  std::string out;
  bool is_between = false;
  for (const char c : driver_name) {
    if (!is_letter_or_digit(c)) {
      is_between = true;
      continue;
    }
    if (is_between && !out.empty()) out += '_';
    is_between = false;
    out += c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  }
  return out;
}

rt::Result<ControlValue> resolve_control(std::span<const ControlInfo> controls, std::string_view name,
                                         std::string_view text, std::string_view device) {
  const std::string wanted = control_name(name);
  const auto found = std::find_if(controls.begin(), controls.end(), [&](const ControlInfo& c) { return c.name == wanted; });
  const std::string who(device);
  if (found == controls.end() || found->kind == Kind::other) {
    std::vector<std::string> names;
    for (const ControlInfo& c : controls)
      if (c.kind != Kind::other && !c.is_read_only) names.push_back(c.name);
    return refusal(who + " has no control " + std::string(name) + "; it has " + list(names));
  }
  const ControlInfo& control = *found;
  if (control.is_read_only) return refusal(who + " lets its control " + wanted + " be read only; leave it out");
  if (control.is_inactive)
    return refusal(who + " sets " + wanted + " by itself at present; switch its automatic off by a control before it");

  const auto answer = [&](std::int64_t value) { return ControlValue{control.id, value, control.is_64_bit}; };
  const std::string asked = who + " has " + wanted + " asked for as " + std::string(text);
  switch (control.kind) {
    case Kind::boolean: {
      const auto value = parse_switch(text);
      if (!value) return refusal(asked + "; it takes 0 or 1");
      return answer(*value);
    }
    case Kind::menu: {
      const auto value = find_item(control, text);
      if (value) return answer(*value);
      std::vector<std::string> items;
      for (const MenuItem& item : control.menu) items.push_back(item_text(item));
      return refusal(asked + "; it takes " + list(items));
    }
    case Kind::button:
      return answer(1);
    case Kind::integer:
    case Kind::other:
      break;
  }
  const auto value = parse_number(text);
  if (!value) return refusal(asked + "; it takes a number from " + range_text(control));
  // Unsigned: the distance may be wider than a signed 64-bit number.
  const std::uint64_t above_min = static_cast<std::uint64_t>(*value) - static_cast<std::uint64_t>(control.min);
  const bool is_on_grid = control.step <= 1 || above_min % static_cast<std::uint64_t>(control.step) == 0;
  if (*value < control.min || *value > control.max || !is_on_grid) return refusal(asked + "; it takes " + range_text(control));
  return answer(*value);
}

std::vector<ControlInfo> read_controls(int fd) {
  constexpr int kControlsMax = 1024;
  std::vector<ControlInfo> out;
  v4l2_query_ext_ctrl ask{};
  for (int i = 0; i < kControlsMax; ++i) {
    ask.id |= V4L2_CTRL_FLAG_NEXT_CTRL;
    if (call(fd, VIDIOC_QUERY_EXT_CTRL, &ask) != 0) break;
    if (ask.type == V4L2_CTRL_TYPE_CTRL_CLASS || (ask.flags & V4L2_CTRL_FLAG_DISABLED) != 0) continue;
    out.push_back(info_of(fd, ask));
  }
  return out;
}

int set_control(int fd, const ControlValue& control) noexcept {
  v4l2_ext_control setting{};
  setting.id = control.id;
  if (control.is_64_bit)
    setting.value64 = control.value;
  else
    setting.value = static_cast<std::int32_t>(control.value);
  v4l2_ext_controls settings{};
  settings.which = V4L2_CTRL_WHICH_CUR_VAL;
  settings.count = 1;
  settings.controls = &setting;
  return call(fd, VIDIOC_S_EXT_CTRLS, &settings);
}

rt::Result<std::vector<ControlValue>> set_controls(int fd, std::span<const std::pair<std::string, std::string>> wished,
                                                   std::string_view device) {
  std::vector<ControlValue> out;
  for (const auto& [name, text] : wished) {
    // Read anew for each: one control makes others active.
    auto value = resolve_control(read_controls(fd), name, text, device);
    if (!value) return value.error();
    if (const int error = set_control(fd, *value); error != 0)
      return rt::Error{rt::ExitCode::device_unavailable, std::string(device) + " refuses " + name + "=" + text + ": " +
                                                             std::strerror(error) + "; leave it out"};
    out.push_back(*value);
  }
  return out;
}

}  // namespace tactus::hal::v4l2
