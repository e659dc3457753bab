// What a USB camera says of itself: UVC 1.0, one streaming interface with a bulk endpoint for each of its streams.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "hal/raw_frame.hpp"

namespace tactus::guest {

struct StreamSpec {
  hal::PixelFormat format = hal::PixelFormat::depth16;  // or yuyv
  int width = 0, height = 0;                            // pixels
  [[nodiscard]] std::uint32_t frame_bytes() const {
    return static_cast<std::uint32_t>(width) * static_cast<std::uint32_t>(height) * 2;
  }
};

struct CameraSpec {
  std::string name, serial_number;
  std::vector<StreamSpec> streams;  // 1 or 2
  /// In units of 100 ns, as UVC counts; the first is the default.
  std::vector<std::uint32_t> frame_intervals;
};

inline constexpr std::uint32_t kClock_hz = 48'000'000;  // of the times in payload headers
/// One transfer of uvcvideo's, which takes 32 packets of a high-speed bulk endpoint.
inline constexpr std::uint32_t kPayloadBytes = 32 * 512;

/// The endpoint (without the direction bit) and the interface of a stream.
constexpr std::uint8_t endpoint_of(std::size_t stream) { return static_cast<std::uint8_t>(stream + 1); }
constexpr std::uint8_t interface_of(std::size_t stream) { return static_cast<std::uint8_t>(stream + 1); }
/// The processing unit of a colour stream, which has the one control: brightness.
constexpr std::uint8_t processing_unit_of(std::size_t stream) { return static_cast<std::uint8_t>(3 * stream + 2); }

using Bytes = std::vector<std::uint8_t>;

Bytes device_descriptor();
Bytes configuration_descriptor(const CameraSpec& camera);
/// Empty: there is no string of this index.
Bytes string_descriptor(const CameraSpec& camera, std::uint8_t index);

}  // namespace tactus::guest
