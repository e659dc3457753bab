// Opens live sensors: the backends behind v4l2: and openni2:, and what is put beside them.
#pragma once

#include <string>
#include <vector>

#include "firmware_host/live_source.hpp"
#include "hal/camera.hpp"
#include "hal/device_list.hpp"
#include "rt/status.hpp"

namespace tactus::firmware {

/// What a profile asks of a device where the source does not say it.
struct LiveDefaults {
  hal::ModeRequest mode;          // of both cameras; all 0: the devices' own choice
  bool needs_registered = false;  // OpenNI2: depth in its colour camera, or no session
};

/// Opens the cameras, pairs them, reads calibration and gravity. bad_usage and device_unavailable: one sentence that says
/// which device and what it has instead. Boot.
rt::Result<hal::Sensor> open_live(const LiveSource& source, const LiveDefaults& defaults);

/// What every backend sees now. Boot.
std::vector<hal::DeviceList> list_all_devices();

}  // namespace tactus::firmware
