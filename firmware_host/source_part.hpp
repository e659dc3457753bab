// A part of a source, as --frames asks for it, for backends that know no ranges of their own.
#pragma once

#include <cstdint>

#include "firmware_host/frame_range.hpp"
#include "hal/camera.hpp"

namespace tactus::firmware {

/// Plays frames numbered range.first to range.last - 1. A recorder sees these alone. Boot.
void play_numbers(hal::Sensor& sensor, FrameRange range);

/// Of a device, whose numbers begin anywhere: passes over range.first depth frames and ends after range.last of them;
/// colour begins with the first depth frame that is delivered and ends with the first colour frame after the last. Boot.
void play_next_frames(hal::Sensor& sensor, FrameRange range);

}  // namespace tactus::firmware
