// Whole files into memory, with a bound.
#pragma once

#include <filesystem>
#include <string>

#include "rt/status.hpp"

namespace tactus::hal::replay {

/// Lists and calibrations: a day of 100 Hz poses is 700 MB of no use; an hour is 30 MB.
inline constexpr std::size_t kTextBytesMax = std::size_t{64} << 20;
/// Images: 16 Mpixel of incompressible 16-bit PNG.
inline constexpr std::size_t kImageBytesMax = std::size_t{40} << 20;

/// Replaces `out` by the file's bytes, or by its first `bytes_max` when `only_head`. Bad-input error naming
/// the file: missing, not a regular file (a device or pipe could keep the reader for ever), too large,
/// unreadable. `out` keeps its capacity, so a reused buffer stops allocating.
rt::Result<void> read_file(const std::filesystem::path& path, std::size_t bytes_max, std::string& out,
                           bool only_head = false);

}  // namespace tactus::hal::replay
