// Attributes of sysfs: small text files, read whole.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "rt/status.hpp"

namespace tactus::hal::iio {

/// Without the line's end. device_unavailable: why it cannot be read, the driver's own refusals among them.
rt::Result<std::string> read_text(const std::filesystem::path& file);

/// One finite number. device_unavailable.
rt::Result<double> read_number(const std::filesystem::path& file);

/// The same where a driver may leave the file out: nothing when there is none.
rt::Result<std::optional<double>> read_number_if_any(const std::filesystem::path& file);

/// A finite number and nothing else.
std::optional<double> parse_number(std::string_view text);

}  // namespace tactus::hal::iio
