#include "tests/guest/usb_camera/usb_camera.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "rt/clock.hpp"
#include "tests/guest/usb_camera/vhci.hpp"

namespace tactus::guest {
namespace {

bool send_all(int socket, std::span<const std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const ssize_t sent = send(socket, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    if (sent <= 0) return false;
    bytes = bytes.subspan(static_cast<std::size_t>(sent));
  }
  return true;
}

// Rounded up: too early would be a turn for nothing.
int milliseconds_until(std::optional<rt::HostTime> when, rt::HostTime now) {
  if (!when) return -1;
  return when->ns <= now.ns ? 0 : static_cast<int>((when->ns - now.ns + 999'999) / 1'000'000);
}

}  // namespace

UsbCamera::UsbCamera(const CameraSpec& camera, std::shared_ptr<const Clip> clip, int port)
    : camera_(camera), clip_(std::move(clip)), port_(port) {}

UsbCamera::~UsbCamera() { unplug(); }

rt::Result<void> UsbCamera::plug(const PlayOptions& options) {
  unplug();
  std::array<int, 2> ends{};
  stop_event_ = eventfd(0, EFD_CLOEXEC);
  if (stop_event_ < 0 || socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0)
    return rt::Error{rt::ExitCode::failed, std::string("No socket for a USB camera: ") + std::strerror(errno) + "."};
  is_plugged_ = true;
  // The kernel asks its first questions while it is still being handed its end.
  thread_ = std::thread([this, options, socket = ends[0]] { serve(options, socket); });
  auto attached = attach_to_port(port_, ends[1]);
  close(ends[1]);
  if (!attached) unplug();
  return attached;
}

void UsbCamera::unplug() {
  if (thread_.joinable()) {
    const std::uint64_t one = 1;
    (void)!write(stop_event_, &one, sizeof(one));
    thread_.join();
  }
  if (stop_event_ >= 0) close(stop_event_);
  stop_event_ = -1;
}

std::vector<ShownFrame> UsbCamera::take_shown() {
  const std::lock_guard lock(mutex_);
  return std::exchange(shown_, {});
}

void UsbCamera::serve(PlayOptions options, int socket) {
  const rt::Clock clock = rt::Clock::monotonic();
  Device device(camera_, clip_, options);
  std::vector<std::uint8_t> buffer(1 << 16);
  for (;;) {
    const auto due = device.step(clock.now());
    const auto shown = device.take_shown();
    if (!shown.empty()) {
      const std::lock_guard lock(mutex_);
      shown_.insert(shown_.end(), shown.begin(), shown.end());
    }
    if (!send_all(socket, device.take_output()) || device.is_unplugged()) break;
    std::array<pollfd, 2> events{pollfd{socket, POLLIN, 0}, pollfd{stop_event_, POLLIN, 0}};
    if (poll(events.data(), events.size(), milliseconds_until(due, clock.now())) < 0 && errno != EINTR) break;
    if (events[1].revents != 0) break;
    if (events[0].revents == 0) continue;
    const ssize_t received = recv(socket, buffer.data(), buffer.size(), 0);
    if (received < 0 && errno == EINTR) continue;
    if (received <= 0 || !device.feed(std::span(buffer).first(static_cast<std::size_t>(received)), clock.now())) break;
  }
  close(socket);
  is_plugged_ = false;
}

}  // namespace tactus::guest
