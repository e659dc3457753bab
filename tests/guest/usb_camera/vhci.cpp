#include "tests/guest/usb_camera/vhci.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>

#include "rt/clock.hpp"

namespace tactus::guest {
namespace {

using namespace rt::literals;

constexpr const char* kAttach = "/sys/devices/platform/vhci_hcd.0/attach";
constexpr int kHighSpeed = 3;  // enum usb_device_speed

}  // namespace

rt::Result<void> attach_to_port(int port, int socket) {
  const int file = open(kAttach, O_WRONLY | O_CLOEXEC);
  if (file < 0) {
    return rt::Error{rt::ExitCode::device_unavailable,
                     std::string(kAttach) + ": " + std::strerror(errno) + "; load the module vhci-hcd, as root."};
  }
  // Port, socket, bus and device number, speed.
  const std::string order = std::to_string(port) + " " + std::to_string(socket) + " " +
                            std::to_string((1 << 16) | (port + 1)) + " " + std::to_string(kHighSpeed);
  const rt::Clock clock = rt::Clock::monotonic();
  const rt::HostTime give_up = clock.now() + 10_s;
  ssize_t written = -1;
  int error = 0;
  for (;;) {
    written = write(file, order.data(), order.size());
    error = errno;
    // Busy: the kernel has not yet done with the one before.
    if (written > 0 || error != EBUSY || clock.now() > give_up) break;
    clock.sleep_until(clock.now() + 20_ms);
  }
  close(file);
  if (written > 0) return {};
  return rt::Error{rt::ExitCode::device_unavailable,
                   "The port " + std::to_string(port) + " of vhci_hcd takes no device: " + std::strerror(error) + "."};
}

}  // namespace tactus::guest
