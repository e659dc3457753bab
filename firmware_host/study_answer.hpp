// How a study that is one table ends.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "firmware_host/options.hpp"
#include "firmware_host/study_sets.hpp"

namespace tactus::firmware {

/// Adds what was left out to `text`; writes NAME.json into --out when that is given. The answer is what the
/// program prints: the text, or the JSON with --json. failed when a file cannot be written.
rt::Result<std::string> study_answer(const StudyOptions& options, const StudySets& sets, const std::string& name,
                                     std::string text, const nlohmann::json& json_sets);

}  // namespace tactus::firmware
