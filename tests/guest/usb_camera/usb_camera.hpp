// A USB camera in user space, plugged into this very machine's kernel: the real uvcvideo drives it.
#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "rt/status.hpp"
#include "tests/guest/usb_camera/device.hpp"

namespace tactus::guest {

/// A thread serves it while it is plugged in. All functions may be called by any thread; they are not for steps.
class UsbCamera {
 public:
  /// Still lies on the table. `port`: of vhci_hcd, 0 to 7, its own.
  UsbCamera(const CameraSpec& camera, std::shared_ptr<const Clip> clip, int port);
  ~UsbCamera();
  UsbCamera(const UsbCamera&) = delete;
  UsbCamera& operator=(const UsbCamera&) = delete;

  /// The kernel then takes its time to find the device and its nodes.
  rt::Result<void> plug(const PlayOptions& options);
  /// Nothing when it is not in.
  void unplug();
  /// False after unplug() and from PlayOptions::unplug_at on.
  [[nodiscard]] bool is_plugged() const { return is_plugged_.load(); }
  /// The frames that it began to send since the last call.
  std::vector<ShownFrame> take_shown();

 private:
  void serve(PlayOptions options, int socket);

  const CameraSpec camera_;
  const std::shared_ptr<const Clip> clip_;
  const int port_;
  std::thread thread_;
  std::atomic<bool> is_plugged_{false};
  int stop_event_ = -1;
  std::mutex mutex_;
  std::vector<ShownFrame> shown_;  // under mutex_
};

}  // namespace tactus::guest
