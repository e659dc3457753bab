// What a network's classes are made of, and how it wants its image: one TOML file per network
// (segment/models).
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "pipeline/label/material.hpp"
#include "rt/status.hpp"

namespace tactus::segment {

/// The file (ASCII):
///
///     [network]
///     name = "deeplabv3_mnv2_ade20k"
///     temperature = 1.0             # scores are divided by it before the softmax; > 1 makes the network
///     less sure [input] order = "rgb"                 # or "bgr" mean = [127.0, 127.0, 127.0]  # real input
///     = (byte - mean) / std, per channel in the order above std = [127.5, 127.5, 127.5]
///     [[class]]                     # one per network class, in the network's order
///     name = "wall"
///     materials = { painted = 0.75, wallpaper = 0.25 }   # names of kMaterialNames; sums to 1 (+- 0.001)
struct ClassMap {
  std::string file;  // for messages
  std::string network;
  float temperature = 1;
  bool is_bgr = false;
  std::array<float, 3> mean{}, std{};
  std::vector<std::string> class_names;
  std::vector<MaterialDistribution> materials;  // per class; each sums to 1
};

/// Error (bad_usage): the first thing that is wrong, with file, line and key; unknown keys are errors, since
/// a misspelt one would be ignored otherwise. Phase: boot. Pure.
rt::Result<ClassMap> parse_class_map(std::string_view text, const std::string& file);

/// Reads the file, then parse_class_map. Phase: boot.
rt::Result<ClassMap> load_class_map(const std::string& path);

}  // namespace tactus::segment
