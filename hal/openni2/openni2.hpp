// OpenNI2: depth cameras with or without colour, and its .oni recordings, as sensors.
//
// The library is started once per process and never shut down: its shutdown can crash after some drivers. Its seek() is
// never called, for the same reason. Both are OpenNI 2.2's; Debian ships no other.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <string>

#include "hal/camera.hpp"
#include "hal/device_list.hpp"
#include "hal/live_camera.hpp"
#include "rt/status.hpp"

namespace tactus::hal::openni2 {

struct OpenNi2Request {
  std::string uri = {};         // as list_devices() says it; empty: the first device
  ModeRequest mode = {};        // of depth; colour takes the same size where it can
  bool wants_color = true;      // without it, or on a device that has none: depth only
  bool wants_registered = true; // depth in the colour camera, where the device can
  bool wants_sync = true;       // both exposed together, where the device can
};

/// Opens a device and starts it. Frames go through buffers of ours, allocated here; a reader that is late finds the newest
/// few, and the others as missing. Times are the device's clock; when the device goes away and comes back, a thread of ours
/// opens it again in the same mode, and its clock and numbers go on from where they were. read() makes no call into the
/// library and no heap call, and waits no longer than its timeout. The calibration is assumed from the fields of view that
/// the device tells; a note says so. Errors: device_unavailable (not built in, none plugged in, busy, no depth camera),
/// bad_usage (a mode that it does not have, with those that it has). Boot; any thread.
rt::Result<Sensor> open_openni2(const OpenNi2Request& request);

struct OniOptions {
  /// Depth frames [first, last), counted from 0, with the colour frames within 20 ms of them.
  std::uint64_t first = 0;
  std::uint64_t last = std::numeric_limits<std::uint64_t>::max();
  /// Frames that a thread per camera decodes ahead; then read() makes no heap call. 0: read() decodes itself.
  std::size_t prefetch = 0;
};

/// Opens an .oni recording, each frame of it exactly once. Sequence numbers count the file's frames from 0, times are the
/// recording's, to the microsecond. The file's records are checked before the library sees them; one that is damaged or
/// empty, or cut so that the library does not open it, is refused with one sentence (bad_input); a frame that cannot be
/// decoded is left out and counted. bad_usage: the range holds no frame. device_unavailable: not built
/// in. Boot; any thread.
rt::Result<Sensor> open_oni(const std::filesystem::path& file, const OniOptions& options);

/// The devices that the library sees now, with their modes. A device is opened for a moment to ask it. Boot.
DeviceList list_devices();

}  // namespace tactus::hal::openni2
