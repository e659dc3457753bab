// The CRF's parameters from a TOML file.
#pragma once

#include <string>
#include <string_view>

#include "pipeline/label/crf/crf.hpp"
#include "rt/status.hpp"

namespace tactus::label {

/// The file (ASCII); what is left out keeps the preset's value:
///
///     preset = "default"            # or "paper"
///     iterations_max = 15
///     settled_change = 0.001
///     normalisation = "symmetric"   # or "per_point"
///     [smoothness]
///     weight = 1.3
///     theta_position_m = 0.03
///     [appearance]
///     weight = 4.0
///     theta_position_m = 0.3
///     theta_color = 20.0            # of 255
///     [surface]
///     weight = 1.0
///     theta_position_m = 0.05
///     theta_normal = 0.1
///     [compatibility]               # left out: Potts
///     default_cost = 1.0            # of every pair that is not named; 0 between a material and itself
///     [[compatibility.pair]]
///     materials = ["painted", "wallpaper"]
///     cost = 0.3
///
/// Error (bad_usage): the first thing that is wrong, with file, line and key; unknown keys are errors, since
/// a misspelt one would be ignored otherwise. Phase: boot. Pure.
rt::Result<CrfParameters> parse_crf_parameters(std::string_view text, const std::string& file);

/// Reads the file, then parse_crf_parameters. Phase: boot.
rt::Result<CrfParameters> load_crf_parameters(const std::string& path);

/// The file that parse_crf_parameters reads as these parameters, to the last bit of every number. Phase:
/// boot.
std::string format_crf_parameters(const CrfParameters& parameters);

}  // namespace tactus::label
