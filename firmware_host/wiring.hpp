// `tactus wiring`: the wiring table as text or as a graph.
#pragma once

#include <string>

#include "firmware_host/options.hpp"
#include "rt/status.hpp"

namespace tactus::firmware {

rt::Result<std::string> wiring(const WiringOptions& options);

}  // namespace tactus::firmware
