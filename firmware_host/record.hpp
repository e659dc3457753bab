// `tactus record`: a source's frames into one file, as they come.
#pragma once

#include <string>

#include "firmware_host/options.hpp"
#include "rt/status.hpp"

namespace tactus::firmware {

/// Until the source ends, the time is over or SIGINT; what was written until then is kept whatever ends it. Errors: the
/// source cannot be opened, the file exists or cannot be written; no frame came at all. Boot.
rt::Result<std::string> record(const RecordOptions& options);

}  // namespace tactus::firmware
