// Which network labels the room, and how its classes map to materials.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "firmware_host/run_settings.hpp"
#include "hal/camera.hpp"
#include "pipeline/segment/class_map.hpp"
#include "pipeline/segment/tflite_model.hpp"

namespace tactus::firmware {

struct LabelChoice {
  std::optional<segment::LoadedModel> model;
  segment::ClassMap class_map;
  bool from_source = false;
  std::string name;    // for the summary; empty: no labels
  std::string remark;  // one sentence when labels are missing or not a network's
};

/// `model`: --model; a file, "builtin", "none", or empty. Empty with labels.source = auto: a synthetic source's own exact
/// labels, else the network that comes with the program. Boot.
rt::Result<LabelChoice> choose_labels(const std::string& source, const std::filesystem::path& model,
                                      const RunSettings& settings, const hal::Sensor& sensor);

}  // namespace tactus::firmware
