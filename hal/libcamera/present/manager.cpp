#include "hal/libcamera/present/manager.hpp"

#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <mutex>
#include <system_error>
#include <vector>

namespace tactus::hal::libcamera {
namespace {

struct Shared {
  std::mutex mutex;  // guards both; held while the manager is made and while it goes, since two at once end the program
  std::unique_ptr<lc::CameraManager> manager;
  int users_count = 0;
};
Shared& shared() {
  static Shared it;
  return it;
}

void leave(lc::CameraManager*) {
  const std::lock_guard lock(shared().mutex);
  if (--shared().users_count == 0) shared().manager.reset();
}

}  // namespace

rt::Result<std::shared_ptr<lc::CameraManager>> camera_manager() {
  const std::lock_guard lock(shared().mutex);
  if (!shared().manager) {
    if (std::getenv("LIBCAMERA_LOG_LEVELS") == nullptr && std::getenv("LIBCAMERA_LOG_FILE") == nullptr)
      lc::logSetTarget(lc::LoggingTargetNone);
    auto manager = std::make_unique<lc::CameraManager>();
    const int error = manager->start();
    if (error != 0)
      return rt::Error{rt::ExitCode::device_unavailable,
                       "libcamera does not start: " + std::generic_category().message(-error) +
                           "; set LIBCAMERA_LOG_LEVELS=*:DEBUG to see its own messages."};
    shared().manager = std::move(manager);
  }
  ++shared().users_count;
  return std::shared_ptr<lc::CameraManager>(shared().manager.get(), leave);
}

std::string explain_no_camera(const std::filesystem::path& dev,
                              const std::function<bool(const std::filesystem::path&)>& may_open) {
  std::vector<std::filesystem::path> media;
  std::error_code error;
  for (std::filesystem::directory_iterator it(dev, error), end; !error && it != end; it.increment(error))
    if (it->path().filename().string().starts_with("media")) media.push_back(it->path());
  std::sort(media.begin(), media.end());
  if (media.empty())
    return "There is no " + (dev / "media0").string() +
           ": no camera is plugged in, or the kernel has no driver for it (lsusb and dmesg tell).";
  const auto forbidden = std::find_if_not(media.begin(), media.end(), may_open);
  if (forbidden != media.end())
    return "No permission to open " + forbidden->string() +
           ": add the user to the group video (usermod -aG video USER) and log in again.";
  return "libcamera has no pipeline for what is behind " + media.front().string() +
         (media.size() > 1 ? " to " + media.back().filename().string() : "") +
         ", or udev does not run; take the camera through v4l2:/dev/videoN.";
}

std::string explain_no_camera() {
  return explain_no_camera("/dev", [](const std::filesystem::path& file) { return access(file.c_str(), R_OK | W_OK) == 0; });
}

}  // namespace tactus::hal::libcamera
