// DMA-BUFs from whoever exports them: a second V4L2 node, a DMA heap, or udmabuf.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "hal/v4l2/negotiation.hpp"
#include "hal/v4l2/node.hpp"
#include "rt/status.hpp"

namespace tactus::hal::v4l2 {

struct DmaBuffer {
  Descriptor fd;
  std::size_t bytes = 0;
};

/// `count` buffers of at least agreement.image_bytes. `exporter`: see V4l2Request::dmabuf_exporter; is filled in when it was
/// empty. A V4L2 exporter is put into the same format and let go at once; its buffers live on. Boot.
rt::Result<std::vector<DmaBuffer>> export_buffers(std::string& exporter, std::uint32_t count, const Agreement& agreement);

}  // namespace tactus::hal::v4l2
