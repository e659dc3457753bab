// A recording's first chunk: what was recorded, as TOML, so that a person can read it with any tool.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "hal/calibration.hpp"
#include "hal/record/tac.hpp"
#include "rt/status.hpp"

namespace tactus::hal::record {

struct FileHeader {
  std::string description;
  RigCalibration calibration;
  double frame_rate_hz = 30;
  bool was_live = false, has_two_clocks = false;
  std::optional<Vec3d> gravity_depth;
  TacInfo info;
};

/// ASCII; every number reads back to the same bits.
std::string format_file_header(const FileHeader& header);

/// The inverse. Keys that it does not know are passed over: a later program may write more. bad_input, one sentence that
/// begins with `file`, when something is missing or cannot be a camera: sides of 1 to 8192 pixels and 16 Mpixel together,
/// finite numbers, focal lengths, rate and unit above 0, a rotation that is one to 1e-6.
rt::Result<FileHeader> parse_file_header(std::string_view text, const std::string& file);

}  // namespace tactus::hal::record
