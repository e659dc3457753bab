// Cameras that the kernel drives through V4L2: depth in Z16, Y16 and Y12, colour in YUYV, NV12, RGB3 and MJPG.
//
//   driver -> [buffer][buffer][buffer][buffer] -> read(): converted straight into the caller's memory, the only copy
//
// At most one buffer is held, by peek() until read() or skip(); the others are the driver's.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "hal/device_list.hpp"
#include "hal/live_camera.hpp"
#include "rt/status.hpp"

namespace tactus::hal::v4l2 {

/// Whose memory the driver writes into.
enum class Buffers : std::uint8_t {
  mmap,     // its own, mapped here
  userptr,  // pages of this program
  dmabuf,   // imported from an exporter
};

struct V4l2Request {
  std::string device;                // a node, "/dev/video0", or a link to one
  ModeRequest mode;                  // 0: nearest to 640 x 480 and 30 Hz that the device offers
  std::string format;                // "Z16", "YUYV"; empty: the best that reaches the rate
  Buffers buffers = Buffers::mmap;
  /// With dmabuf: who gives the memory. A second capture node ("/dev/video2", idle meanwhile), "/dev/dma_heap/NAME" or
  /// "/dev/udmabuf". Empty: udmabuf, or else the system heap, where the kernel has them.
  std::string dmabuf_exporter;
  /// Set in this order, named as v4l2-ctl names them: {"exposure_time_absolute", "100"}; menu items by number or name.
  std::vector<std::pair<std::string, std::string>> controls;
};

/// Opens the node, negotiates, starts the stream. Errors name what the device has instead. The camera's read path makes no
/// heap call, with MJPG but for libjpeg's (in a GuestScope); what the driver had filled before the first read is passed
/// over and not counted. FrameHeader::time: the kernel's stamp of the frame, of a UVC camera with metadata the begin of its
/// exposure; a note says which. When the device comes back after a loss at the same bus, under whatever number, it goes on
/// in the same mode and with the same controls. Boot.
rt::Result<LiveCamera<DepthCamera>> open_depth(const V4l2Request& request);
rt::Result<LiveCamera<ColorCamera>> open_color(const V4l2Request& request);

/// All capture nodes and what of their formats can be read. Boot.
DeviceList list_devices();

}  // namespace tactus::hal::v4l2
