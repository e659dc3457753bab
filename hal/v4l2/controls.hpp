// Controls by name: what v4l2-ctl calls them, what they take, and setting them.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "rt/status.hpp"

namespace tactus::hal::v4l2 {

struct MenuItem {
  std::int64_t index = 0;
  std::string label;
};

struct ControlInfo {
  enum class Kind : std::uint8_t { integer, boolean, menu, button, other };
  std::uint32_t id = 0;
  std::string name;  // as v4l2-ctl names it
  Kind kind = Kind::other;
  bool is_64_bit = false, is_read_only = false, is_inactive = false;
  std::int64_t min = 0, max = 0, step = 1;
  std::vector<MenuItem> menu;
};

struct ControlValue {
  std::uint32_t id = 0;
  std::int64_t value = 0;
  bool is_64_bit = false;
};

/// "Exposure Time, Absolute" -> "exposure_time_absolute": lower case, what is neither letter nor digit becomes one '_'
/// between words.
std::string control_name(std::string_view driver_name);

/// The value that `text` asks of the control `name`. Error: one sentence that begins with `device`: no such control (names
/// those there are), not settable, out of range (says it), no such item (names them).
rt::Result<ControlValue> resolve_control(std::span<const ControlInfo> controls, std::string_view name,
                                         std::string_view text, std::string_view device);

/// All controls of the node but arrays and texts. Boot.
std::vector<ControlInfo> read_controls(int fd);

/// 0, or the error's number. No heap.
int set_control(int fd, const ControlValue& control) noexcept;

/// Sets `wished` in order; answers what was set, to be set again on a device that comes back. Boot.
rt::Result<std::vector<ControlValue>> set_controls(int fd,
                                                   std::span<const std::pair<std::string, std::string>> wished,
                                                   std::string_view device);

}  // namespace tactus::hal::v4l2
