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

/// `model`: --model, may be empty. With labels.source = auto a network is looked for beside the recording
/// (SOURCE/../models/*.tflite, first by name), then a synthetic source's own exact labels are taken. Boot.
rt::Result<LabelChoice> choose_labels(const std::string& source, const std::filesystem::path& model,
                                      const RunSettings& settings, const hal::Sensor& sensor);

}  // namespace tactus::firmware
