// The profile of a run: a built-in one or a TOML file, with single values changed by --set key=value.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "pipeline/profile.hpp"
#include "pipeline/render/light.hpp"
#include "rt/status.hpp"

namespace tactus::firmware {

/// Where labels come from.
enum class LabelSource : std::uint8_t { automatic, network, truth, off };

struct RunSettings {
  Profile profile;
  std::string profile_name;
  LabelSource label_source = LabelSource::automatic;
  std::string class_map;  // file; empty: the built-in one for the network
  std::optional<render::Light> light;  // unset: estimated from the video
};

/// Keys that --set and a profile file take, one line each, for --help.
const char* settings_help();

/// bad_usage with the key (and the line of the file) that is wrong and what is allowed. Boot.
rt::Result<RunSettings> read_settings(const std::string& profile, std::span<const std::string> settings);

}  // namespace tactus::firmware
