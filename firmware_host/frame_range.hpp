// Which frames of a source: the A:B of --frames.
#pragma once

#include <cstdint>
#include <limits>
#include <string_view>

#include "rt/status.hpp"

namespace tactus::firmware {

/// Frames first .. last - 1 of a source, counted from 0; of a device, from where it is opened.
struct FrameRange {
  std::uint64_t first = 0;
  std::uint64_t last = std::numeric_limits<std::uint64_t>::max();
  [[nodiscard]] bool is_everything() const { return *this == FrameRange{}; }
  friend bool operator==(const FrameRange&, const FrameRange&) = default;
};

/// "A:B" is [A, B), "A:" from A on, ":B" and "B" the first B. bad_usage for anything else and for empty
/// ranges.
rt::Result<FrameRange> parse_frame_range(std::string_view text);

}  // namespace tactus::firmware
