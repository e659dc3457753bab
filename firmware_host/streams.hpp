// Reading both cameras of a sensor on one thread, for commands that look at all that comes.
#pragma once

#include <cstdint>
#include <functional>
#include <span>

#include "hal/camera.hpp"
#include "rt/status.hpp"

namespace tactus::firmware {

struct StreamsReader {
  std::function<void(const hal::FrameHeader&, std::span<const std::uint16_t>)> depth;
  std::function<void(const hal::FrameHeader&)> color;
  /// Colour is passed over in the device's buffer: a recorder sees it, nobody else needs its pixels.
  bool skips_color = false;
  /// Asked after each depth frame and while nothing comes.
  std::function<bool()> is_over;
};

struct StreamsEnd {
  rt::Status depth = rt::Status::ok;  // what depth answered last; ok: is_over() said so
  rt::Status color = rt::Status::ok;  // the same; end_of_stream without a colour camera
};

/// Takes depth and colour in the order of their times; from a device as they come. A device that is away is waited for
/// until `patience` is over, one that says nothing for as long, and a recording for a second. Rejected frames stay in the
/// cameras' counters. Allocates.
StreamsEnd read_streams(hal::Sensor& sensor, const StreamsReader& reader, rt::Duration patience);

}  // namespace tactus::firmware
