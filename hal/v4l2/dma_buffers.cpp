#include "hal/v4l2/dma_buffers.hpp"

#include <fcntl.h>
#include <linux/dma-heap.h>
#include <linux/udmabuf.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

namespace tactus::hal::v4l2 {
namespace {

constexpr const char* kUdmabuf = "/dev/udmabuf";
constexpr const char* kSystemHeap = "/dev/dma_heap/system";

rt::Error trouble(const std::string& exporter, const std::string& what, int error) {
  return {rt::ExitCode::device_unavailable, exporter + " exports no buffers (" + what + ": " + std::strerror(error) +
                                                "); name another exporter, or use mmap buffers"};
}

std::size_t whole_pages(std::size_t bytes) {
  const auto page = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
  return (bytes + page - 1) / page * page;
}

rt::Result<std::vector<DmaBuffer>> from_udmabuf(int fd, const std::string& exporter, std::uint32_t count,
                                                std::size_t bytes) {
  std::vector<DmaBuffer> out;
  bytes = whole_pages(bytes);
  for (std::uint32_t i = 0; i < count; ++i) {
    const Descriptor pages(::memfd_create("tactus-frame", MFD_CLOEXEC | MFD_ALLOW_SEALING));
    if (!pages.is_open() || ::ftruncate(pages.get(), static_cast<off_t>(bytes)) != 0 ||
        ::fcntl(pages.get(), F_ADD_SEALS, F_SEAL_SHRINK) != 0)
      return trouble(exporter, "memory for it", errno);
    udmabuf_create create{};
    create.memfd = static_cast<std::uint32_t>(pages.get());
    create.flags = UDMABUF_FLAGS_CLOEXEC;
    create.size = bytes;
    const int buffer = ::ioctl(fd, UDMABUF_CREATE, &create);
    if (buffer < 0) return trouble(exporter, "UDMABUF_CREATE", errno);
    out.push_back({Descriptor(buffer), bytes});
  }
  return out;
}

rt::Result<std::vector<DmaBuffer>> from_heap(int fd, const std::string& exporter, std::uint32_t count, std::size_t bytes) {
  std::vector<DmaBuffer> out;
  for (std::uint32_t i = 0; i < count; ++i) {
    dma_heap_allocation_data allocation{};
    allocation.len = whole_pages(bytes);
    allocation.fd_flags = O_RDWR | O_CLOEXEC;
    if (const int error = call(fd, DMA_HEAP_IOCTL_ALLOC, &allocation); error != 0)
      return trouble(exporter, "DMA_HEAP_IOCTL_ALLOC", error);
    out.push_back({Descriptor(static_cast<int>(allocation.fd)), static_cast<std::size_t>(allocation.len)});
  }
  return out;
}

/// The format for the exporter, by whichever of the two calls it understands.
v4l2_format format_for(const Agreement& agreement, bool is_multiplanar) {
  if (is_multiplanar == agreement.is_multiplanar()) return agreement.format;
  v4l2_format format{};
  const auto width = static_cast<std::uint32_t>(agreement.width), height = static_cast<std::uint32_t>(agreement.height);
  if (is_multiplanar) {
    format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE;
    format.fmt.pix_mp.width = width;
    format.fmt.pix_mp.height = height;
    format.fmt.pix_mp.pixelformat = agreement.fourcc();
    format.fmt.pix_mp.num_planes = 1;
  } else {
    format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    format.fmt.pix.width = width;
    format.fmt.pix.height = height;
    format.fmt.pix.pixelformat = agreement.fourcc();
  }
  return format;
}

rt::Result<std::vector<DmaBuffer>> from_node(int fd, const std::string& exporter, std::uint32_t count,
                                             const Agreement& agreement) {
  NodeInfo info;
  if (const int error = read_info(fd, info); error != 0) return trouble(exporter, "VIDIOC_QUERYCAP", error);
  if (!info.is_capture()) return trouble(exporter, "it does not capture images", EINVAL);
  const bool is_multiplanar = info.is_multiplanar();
  v4l2_format format = format_for(agreement, is_multiplanar);
  if (const int error = call(fd, VIDIOC_S_FMT, &format); error != 0) return trouble(exporter, "VIDIOC_S_FMT", error);
  const std::size_t bytes = is_multiplanar ? format.fmt.pix_mp.plane_fmt[0].sizeimage : format.fmt.pix.sizeimage;
  if (bytes < agreement.image_bytes)
    return rt::Error{rt::ExitCode::device_unavailable,
                     exporter + " exports buffers of " + std::to_string(bytes) + " bytes, too few for frames of " +
                         std::to_string(agreement.image_bytes) + "; name another exporter, or use mmap buffers"};
  v4l2_requestbuffers ask{};
  ask.count = count;
  ask.type = format.type;
  ask.memory = V4L2_MEMORY_MMAP;
  if (const int error = call(fd, VIDIOC_REQBUFS, &ask); error != 0) return trouble(exporter, "VIDIOC_REQBUFS", error);
  if (ask.count < count) return trouble(exporter, "VIDIOC_REQBUFS", ENOMEM);
  std::vector<DmaBuffer> out;
  for (std::uint32_t i = 0; i < count; ++i) {
    v4l2_exportbuffer wanted{};
    wanted.type = format.type;
    wanted.index = i;
    wanted.flags = O_RDWR | O_CLOEXEC;
    if (const int error = call(fd, VIDIOC_EXPBUF, &wanted); error != 0) return trouble(exporter, "VIDIOC_EXPBUF", error);
    out.push_back({Descriptor(wanted.fd), whole_pages(bytes)});
  }
  return out;
}

}  // namespace

rt::Result<std::vector<DmaBuffer>> export_buffers(std::string& exporter, std::uint32_t count, const Agreement& agreement) {
  if (exporter.empty()) {
    if (::access(kUdmabuf, R_OK | W_OK) == 0)
      exporter = kUdmabuf;
    else if (::access(kSystemHeap, R_OK | W_OK) == 0)
      exporter = kSystemHeap;
    else
      return rt::Error{rt::ExitCode::device_unavailable,
                       std::string("this kernel has neither ") + kUdmabuf + " nor " + kSystemHeap +
                           ", or gives no permission; name a second camera as the exporter of the buffers, or use mmap"};
  }
  const bool is_heap = exporter.starts_with("/dev/dma_heap/");
  const Descriptor source(::open(exporter.c_str(), (is_heap ? O_RDONLY : O_RDWR) | O_NONBLOCK | O_CLOEXEC));
  if (!source.is_open()) return rt::Error{rt::ExitCode::device_unavailable, open_trouble(exporter, errno)};
  if (exporter == kUdmabuf) return from_udmabuf(source.get(), exporter, count, agreement.image_bytes);
  if (is_heap) return from_heap(source.get(), exporter, count, agreement.image_bytes);
  return from_node(source.get(), exporter, count, agreement);
}

}  // namespace tactus::hal::v4l2
