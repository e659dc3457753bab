// `tactus eval labels`.
#pragma once

#include <string>

#include "firmware_host/options.hpp"
#include "rt/status.hpp"

namespace tactus::firmware {

/// Runs the source in lockstep and scores every method at the frames with truth; text or JSON for standard
/// output. Errors: as `tactus run`; bad_input for true labels that do not fit.
rt::Result<std::string> eval_labels(const EvalLabelsOptions& options);

}  // namespace tactus::firmware
