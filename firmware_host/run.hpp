// `tactus run`: the main job, from the command line to the output files.
#pragma once

#include <string>

#include "firmware_host/options.hpp"
#include "rt/status.hpp"

namespace tactus::firmware {

/// Text for standard output. SIGINT and SIGTERM end the session after the frame at hand; every output is
/// written then.
rt::Result<std::string> run(const RunOptions& options);

}  // namespace tactus::firmware
