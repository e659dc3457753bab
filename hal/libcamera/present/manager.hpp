// libcamera's manager of all cameras, of which a process may have one at a time.
#pragma once

#include <libcamera/libcamera.h>

#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "rt/status.hpp"

namespace tactus::hal::libcamera {

namespace lc = ::libcamera;

/// Starts it, and with it libcamera's thread, for the first who asks; it is gone with the last. libcamera's messages are
/// switched off unless LIBCAMERA_LOG_LEVELS or LIBCAMERA_LOG_FILE is set: what matters is answered in words of ours.
/// device_unavailable. Boot, any thread.
rt::Result<std::shared_ptr<lc::CameraManager>> camera_manager();

/// One sentence: why libcamera sees no camera. `dev`: the folder /dev; `may_open`: whether this process may open a file.
std::string explain_no_camera(const std::filesystem::path& dev,
                              const std::function<bool(const std::filesystem::path&)>& may_open);
std::string explain_no_camera();

}  // namespace tactus::hal::libcamera
