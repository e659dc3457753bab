// From the word SOURCE on the command line to an opened sensor: the only place that names backends.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <string_view>

#include "hal/camera.hpp"
#include "rt/status.hpp"

namespace tactus::firmware {

/// Frames first .. last - 1 of a source, counted from 0.
struct FrameRange {
  std::uint64_t first = 0;
  std::uint64_t last = std::numeric_limits<std::uint64_t>::max();
  [[nodiscard]] bool is_everything() const { return *this == FrameRange{}; }
  friend bool operator==(const FrameRange&, const FrameRange&) = default;
};

/// "A:B" is [A, B), "A:" from A on, ":B" and "B" the first B. bad_usage for anything else and for empty
/// ranges.
rt::Result<FrameRange> parse_frame_range(std::string_view text);

struct SourceOptions {
  FrameRange frames;
  std::size_t prefetch = 0;  // recordings: frames decoded ahead by a thread per camera
};

/// `synthetic:NAME[?...]`, or a folder in TUM RGB-D or 7-Scenes layout. bad_usage for a name that is none of
/// these, bad_input for a recording that cannot be used, device_unavailable for kinds of source that this
/// build has no backend for. Boot.
rt::Result<hal::Sensor> open_source(const std::string& source, const SourceOptions& options = {});

/// The kinds of SOURCE this build opens, for --help.
const char* source_help();

}  // namespace tactus::firmware
