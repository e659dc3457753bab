// A frame as the device gave it, before anything is converted: what recordings keep.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "rt/time.hpp"

namespace tactus::hal {

/// What comes with every image.
struct FrameHeader {
  rt::SensorTime time;          // exposure midpoint on the device's clock
  std::uint64_t sequence = 0;   // counts up by one per frame the device took; a gap is a lost frame
  /// When this machine had it (the kernel's stamp, the driver's call) on the monotonic clock; a recording keeps it. 0:
  /// unknown, as in folders of pictures. Results depend on it only where two devices' clocks are brought together.
  rt::HostTime arrived = {};
};

/// Of recordings too: values never change their meaning.
enum class PixelFormat : std::uint8_t {
  depth16 = 0,  // 16-bit little-endian raw depth: V4L2's Z16, Y16 and Y12, OpenNI2's 1 mm and 100 um
  rgb24 = 1,    // R G B
  yuyv = 2,     // Y0 U Y1 V, BT.601 limited range
  nv12 = 3,     // a plane of Y, then one of U V at half size each way; BT.601 limited range
  mjpeg = 4,    // one JPEG file
};

enum class Stream : std::uint8_t { depth = 0, color = 1 };

struct RawFrame {
  FrameHeader header;
  PixelFormat format = PixelFormat::depth16;
  int width = 0, height = 0;            // pixels
  std::size_t row_bytes = 0;            // from row to row (nv12: of either plane); 0 for mjpeg
  std::span<const std::uint8_t> bytes;  // valid during the call it is handed over in
};

/// Who wants raw frames besides the pipeline: a recorder.
class FrameTap {
 public:
  virtual ~FrameTap() = default;
  /// Copies what it wants of the frame. Called by the thread that reads the camera, in the order of the stream; bounded,
  /// without heap and locks.
  virtual void take(Stream stream, const RawFrame& frame) noexcept = 0;
};

}  // namespace tactus::hal
