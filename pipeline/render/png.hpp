// Pictures as PNG files. Boot and reports only: never inside a step.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "rt/status.hpp"

namespace tactus::render {

/// `rgb`: width_px * height_px * 3 bytes, row-major from the top. Error (failed) with the path and libpng's
/// reason.
rt::Result<void> write_png(const std::filesystem::path& path, std::span<const std::uint8_t> rgb, int width_px,
                           int height_px);

/// The same as bytes in memory, for pictures inside a report.
rt::Result<std::vector<std::uint8_t>> encode_png(std::span<const std::uint8_t> rgb, int width_px,
                                                 int height_px);

}  // namespace tactus::render
