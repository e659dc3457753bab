// The one door through which TOML from outside comes in; toml++'s own parser is called nowhere else.
#pragma once

#include <toml++/toml.h>

#include <string>
#include <string_view>

#include "rt/status.hpp"

namespace tactus::hal {

/// The root table, or one sentence that begins with "FILE:LINE: " and carries `code`. ASCII only: toml++ 3.3 runs into
/// undefined behaviour on letters from U+00A1 to U+0499 outside strings (a fuzzer found it). Boot; allocates.
rt::Result<toml::table> parse_toml(std::string_view text, const std::string& file, rt::ExitCode code);

/// The whole of a settings file of at most 1 MB; "FILE: the WHAT cannot be read" when it is none. Boot; allocates.
rt::Result<std::string> read_settings_file(const std::string& file, std::string_view what);

}  // namespace tactus::hal
