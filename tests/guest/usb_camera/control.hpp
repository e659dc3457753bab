// The control endpoint of a USB camera: standard requests, UVC's bargaining over a stream, brightness of colour (which is
// kept and changes no pixel).
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "tests/guest/usb_camera/descriptors.hpp"

namespace tactus::guest {

class Control {
 public:
  explicit Control(const CameraSpec& camera);

  /// Answers a request; `data` came with it from the host. Nothing: the endpoint stalls.
  std::optional<Bytes> answer(std::span<const std::uint8_t, 8> setup, std::span<const std::uint8_t> data);

  /// A stream whose settings were committed since the last call: frames are wanted from now on.
  std::optional<std::size_t> take_committed();
  /// A stream whose endpoint the host has cleared since the last call, which is how uvcvideo ends a stream.
  std::optional<std::size_t> take_stopped();
  /// As committed, in units of 100 ns.
  [[nodiscard]] std::uint32_t frame_interval(std::size_t stream) const { return settings_[stream].committed; }

 private:
  struct Settings {
    std::uint32_t probed = 0, committed = 0;  // frame intervals, the one thing there is to choose
    std::int16_t brightness = 0;
  };
  std::optional<Bytes> standard(std::uint8_t type, std::uint8_t request, std::uint16_t value, std::uint16_t index);
  std::optional<Bytes> descriptor(std::uint16_t value) const;
  std::optional<Bytes> streaming(std::uint8_t request, std::uint8_t selector, std::size_t stream,
                                 std::span<const std::uint8_t> data);
  std::optional<Bytes> brightness(std::uint8_t request, std::size_t stream, std::span<const std::uint8_t> data);
  [[nodiscard]] Bytes probe_block(std::size_t stream, std::uint32_t frame_interval) const;

  CameraSpec camera_;
  std::vector<Settings> settings_;
  std::optional<std::size_t> committed_, stopped_;
};

}  // namespace tactus::guest
