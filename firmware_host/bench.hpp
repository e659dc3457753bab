// `tactus bench`: the stages of the spine beside their limits and beside the machine.
#pragma once

#include <string>

#include "firmware_host/options.hpp"
#include "rt/status.hpp"

namespace tactus::firmware {

/// Renders its frames ahead, then runs on this thread alone. Never fails because something is slow: figures
/// are for a person to read.
rt::Result<std::string> bench(const BenchOptions& options);

}  // namespace tactus::firmware
