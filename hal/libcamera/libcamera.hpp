// Colour cameras through libcamera, where it was built in: USB webcams, and what else it has a pipeline for.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "hal/camera.hpp"
#include "hal/device_list.hpp"
#include "hal/live_camera.hpp"
#include "rt/status.hpp"

namespace tactus::hal::libcamera {

struct LibcameraRequest {
  std::string id;      // a part of libcamera's id that only one camera has; empty: the first camera
  ModeRequest mode;    // size 0: 640x480 where there is one, else the largest within 1280x720, else the smallest
  std::string format;  // in libcamera's words: BGR888 (R, G, B in memory), YUYV, NV12 or MJPEG; empty: the first of these
                       // in which the camera has the size
  std::vector<std::pair<std::string, std::string>> controls;  // libcamera's names: {"ExposureTime", "10000"}
};

/// Opens the camera, starts it, and reuses its requests from then on: a frame stays in the device's buffer until read()
/// converts it. The newest two wait to be read; an older one goes back to the device and is a gap in the sequence.
/// FrameHeader::time is the buffer's stamp on the monotonic clock, `arrived` when libcamera handed it over.
/// device_unavailable: not built in, no such camera, no permission, in use; bad_usage: a part of an id that several have, a
/// size, format or control that the camera has not. Boot; may wait some seconds. The camera is thread-bound as ColorCamera
/// says; beside it libcamera runs a thread of its own for all its cameras.
rt::Result<LiveCamera<ColorCamera>> open_color(const LibcameraRequest& request);

/// What `tactus devices` shows. Boot.
DeviceList list_devices();

}  // namespace tactus::hal::libcamera
