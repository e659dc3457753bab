// `tactus query`: what a finished map says about a place, and a person's corrections to it.
#pragma once

#include <string>

#include "firmware_host/options.hpp"
#include "rt/status.hpp"

namespace tactus::firmware {

/// Describes the map, or answers a point or a ray; with --set or --unset corrects the surface found there and
/// writes the map. bad_usage when a number cannot be read or there is no surface to correct.
rt::Result<std::string> query(const QueryOptions& options);

}  // namespace tactus::firmware
