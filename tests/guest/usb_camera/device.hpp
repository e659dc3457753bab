// A USB camera as its host sees it through USB/IP: messages in, messages out. It knows no socket and no clock.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "rt/time.hpp"
#include "tests/guest/usb_camera/clip.hpp"
#include "tests/guest/usb_camera/control.hpp"
#include "tests/guest/usb_camera/descriptors.hpp"
#include "tests/guest/usb_camera/payload.hpp"
#include "tests/guest/usb_camera/usbip.hpp"

namespace tactus::guest {

inline constexpr std::size_t kNever = std::numeric_limits<std::size_t>::max();

/// Frames count from 0 at the first after no stream was on.
struct PlayOptions {
  bool repeats = true;          // after the clip's last frame comes its first; else no more
  std::size_t short_at = kNever;   // this frame ends after its first half
  std::size_t error_at = kNever;   // this one is marked as broken
  std::size_t unplug_at = kNever;  // in the middle of this one the camera is gone
};

struct ShownFrame {
  std::size_t frame = 0;
  rt::HostTime time;
};

/// Shows the same frame on all its streams at the same time. When the host is slow the camera waits for it: frames are
/// lost in the driver or nowhere.
class Device {
 public:
  Device(const CameraSpec& camera, std::shared_ptr<const Clip> clip, const PlayOptions& options);

  /// Bytes from the host, in pieces of any size. False: they are no USB/IP.
  bool feed(std::span<const std::uint8_t> bytes, rt::HostTime now);
  /// Does what is due; answers when something will be, if nothing comes from the host. None: nothing.
  std::optional<rt::HostTime> step(rt::HostTime now);
  /// What the host is to get, since the last call.
  Bytes take_output();

  /// It is time for PlayOptions::unplug_at.
  [[nodiscard]] bool is_unplugged() const { return is_unplugged_; }
  /// The frames that were begun since the last call.
  std::vector<ShownFrame> take_shown();

 private:
  struct Stream {
    bool is_on = false;
    std::deque<usbip::Submit> waiting;  // for data
    FrameCutter cutter;
  };
  void submit(const usbip::Submit& request, std::span<const std::uint8_t> data);
  void unlink(const usbip::Unlink& request);
  void answer_control(const usbip::Submit& request, std::span<const std::uint8_t> data);
  void put(const usbip::Message& message, std::span<const std::uint8_t> data = {});
  void switch_streams();
  void show_frame(rt::HostTime now);
  void send(Stream& stream, rt::HostTime now);
  [[nodiscard]] bool can_show() const;

  CameraSpec camera_;
  std::shared_ptr<const Clip> clip_;
  PlayOptions options_;
  Control control_;
  std::vector<Stream> streams_;
  Bytes inbox_, outbox_;
  std::optional<rt::HostTime> next_frame_;  // none: the clock stands still
  std::size_t frame_ = 0;                   // the next one
  rt::Duration interval_;
  bool is_unplugged_ = false;
  std::vector<ShownFrame> shown_;
};

}  // namespace tactus::guest
