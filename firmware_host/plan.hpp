// `tactus plan`: the memory table of a profile.
#pragma once

#include <string>

#include "firmware_host/options.hpp"
#include "rt/status.hpp"

namespace tactus::firmware {

/// At 640x480 with registered colour, or for the cameras of a source. budget_exceeded when the profile's
/// limit does not hold the table without the network.
rt::Result<std::string> plan(const PlanOptions& options);

}  // namespace tactus::firmware
