// The label metrics as JSON, the same for every command that prints them.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "pipeline/evaluate/labels.hpp"

namespace tactus::firmware {

/// The four metrics as shares, what part was labelled, and each class of the truth.
nlohmann::json metrics_json(const evaluate::LabelMetrics& metrics);

}  // namespace tactus::firmware
