// Controls of a camera by name, from text: what a person may set and in which range.
#pragma once

#include <libcamera/libcamera.h>

#include <span>
#include <string>
#include <utility>
#include <vector>

#include "rt/status.hpp"

namespace tactus::hal::libcamera {

namespace lc = ::libcamera;

struct ControlSetting {
  unsigned id = 0;
  lc::ControlValue value;
};

/// "0.5", "true", "1.5,2" for one control. bad_usage: no number, too many or too few of them, or outside of its range;
/// the sentence names the range.
rt::Result<lc::ControlValue> parse_control(const lc::ControlId& id, const lc::ControlInfo& info, const std::string& text);

/// All of them; bad_usage also for a name that the camera has no control of; the sentence lists the names it has.
rt::Result<std::vector<ControlSetting>> parse_controls(const lc::ControlInfoMap& offered,
                                                       std::span<const std::pair<std::string, std::string>> wanted);

}  // namespace tactus::hal::libcamera
