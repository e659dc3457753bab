// The commands: each answers the text for standard output, or the sentence for standard error with its exit
// code.
#pragma once

#include <string>

#include "firmware_host/options.hpp"
#include "rt/status.hpp"

namespace tactus::firmware {

/// Errors of an estimated camera path.
rt::Result<std::string> eval_trajectory(const EvalTrajectoryOptions& options);

/// Distance of a mesh from the true surface, and its labels where both have them.
rt::Result<std::string> eval_surface(const EvalSurfaceOptions& options);

/// Writes a source as a recording folder.
rt::Result<std::string> convert(const ConvertOptions& options);

/// What a source is and what shape it is in; reads all of it unless is_quick.
rt::Result<std::string> info(const InfoOptions& options);

}  // namespace tactus::firmware
