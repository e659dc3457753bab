#include "hal/v4l2/buffers.hpp"

#include <linux/dma-buf.h>
#include <linux/videodev2.h>
#include <sys/mman.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "hal/v4l2/dma_buffers.hpp"

namespace tactus::hal::v4l2 {
namespace {

constexpr const char* name_of(Buffers kind) {
  switch (kind) {
    case Buffers::userptr:
      return "userptr";
    case Buffers::dmabuf:
      return "dmabuf";
    case Buffers::mmap:
      break;
  }
  return "mmap";
}

constexpr v4l2_memory memory_of(Buffers kind) {
  switch (kind) {
    case Buffers::userptr:
      return V4L2_MEMORY_USERPTR;
    case Buffers::dmabuf:
      return V4L2_MEMORY_DMABUF;
    case Buffers::mmap:
      break;
  }
  return V4L2_MEMORY_MMAP;
}

constexpr std::uint32_t flag_of(Buffers kind) {
  switch (kind) {
    case Buffers::userptr:
      return V4L2_BUF_CAP_SUPPORTS_USERPTR;
    case Buffers::dmabuf:
      return V4L2_BUF_CAP_SUPPORTS_DMABUF;
    case Buffers::mmap:
      break;
  }
  return V4L2_BUF_CAP_SUPPORTS_MMAP;
}

/// A v4l2_buffer, with its one plane beside it where the driver wants planes.
struct Argument {
  v4l2_buffer buffer{};
  v4l2_plane plane{};

  Argument(std::uint32_t type, Buffers kind, std::uint32_t index, bool is_multiplanar) {
    buffer.type = type;
    buffer.memory = memory_of(kind);
    buffer.index = index;
    if (!is_multiplanar) return;
    buffer.length = 1;
    buffer.m.planes = &plane;
  }
  Argument(const Argument&) = delete;
  Argument& operator=(const Argument&) = delete;
};

std::string supported_text(std::uint32_t capabilities) {
  std::string text;
  const auto add = [&](std::uint32_t flag, const char* name) {
    if ((capabilities & flag) != 0) text += (text.empty() ? "" : " or ") + std::string(name);
  };
  add(V4L2_BUF_CAP_SUPPORTS_MMAP, "mmap");
  add(V4L2_BUF_CAP_SUPPORTS_USERPTR, "userptr");
  add(V4L2_BUF_CAP_SUPPORTS_DMABUF, "dmabuf");
  return text.empty() ? "mmap" : text;
}

/// What the driver says it supports, asked with the kind that every driver has.
std::uint32_t capabilities_of(int fd, std::uint32_t type) {
  v4l2_requestbuffers ask{};
  ask.type = type;
  ask.memory = V4L2_MEMORY_MMAP;
  return call(fd, VIDIOC_REQBUFS, &ask) == 0 ? ask.capabilities : 0;
}

}  // namespace

int Mapping::map(std::size_t bytes, int fd, std::int64_t offset) noexcept {
  unmap();
  void* address = fd < 0 ? ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_POPULATE, -1, 0)
                         : ::mmap(nullptr, bytes, PROT_READ, MAP_SHARED, fd, offset);
  if (address == MAP_FAILED) return errno;
  data_ = static_cast<std::uint8_t*>(address);
  bytes_ = bytes;
  return 0;
}

void Mapping::unmap() noexcept {
  if (data_ != nullptr) ::munmap(data_, bytes_);
  data_ = nullptr;
  bytes_ = 0;
}

rt::Result<void> BufferSet::attach(int fd, const Agreement& agreement, std::string_view device) {
  type_ = agreement.format.type;
  is_multiplanar_ = agreement.is_multiplanar();
  const auto refusal = [&](std::string what) {
    return rt::Error{rt::ExitCode::device_unavailable, std::string(device) + " " + std::move(what)};
  };
  BufferFault fault = request(fd, kBuffersWanted);
  if (fault.error == EBUSY) return refusal("is in use by another program; close it first");
  if (fault.call != nullptr && fault.error == EINVAL && kind_ != Buffers::mmap) {
    const std::uint32_t capabilities = capabilities_of(fd, type_);
    if ((capabilities & flag_of(kind_)) == 0)
      return refusal("takes no " + std::string(name_of(kind_)) + " buffers; use " + supported_text(capabilities));
  }
  if (fault.call == nullptr && kind_ == Buffers::mmap) fault = map_drivers_memory(fd);
  if (fault.call != nullptr)
    return refusal("gives no buffers (" + std::string(fault.call) + ": " + std::strerror(fault.error) +
                   "); try a smaller size");
  if (kind_ == Buffers::mmap) return {};
  return provide_memory(agreement);
}

bool BufferSet::attach_again(int fd) noexcept {
  const std::uint32_t before = count_;
  if (request(fd, before).call != nullptr || count_ != before) {
    count_ = before;
    return false;
  }
  return kind_ != Buffers::mmap || map_drivers_memory(fd).call == nullptr;
}

void BufferSet::detach() noexcept {
  if (kind_ != Buffers::mmap) return;
  for (Slot& slot : slots_) slot.memory.unmap();
}

BufferFault BufferSet::request(int fd, std::uint32_t count) noexcept {
  v4l2_requestbuffers ask{};
  ask.count = count;
  ask.type = type_;
  ask.memory = memory_of(kind_);
  if (const int error = call(fd, VIDIOC_REQBUFS, &ask); error != 0) return {"VIDIOC_REQBUFS", error};
  if (ask.count < 2) return {"VIDIOC_REQBUFS", ENOMEM};  // one held and none to fill: no frame would ever come
  count_ = std::min(ask.count, kBuffersMax);
  Argument first(type_, kind_, 0, is_multiplanar_);
  if (const int error = call(fd, VIDIOC_QUERYBUF, &first.buffer); error != 0) return {"VIDIOC_QUERYBUF", error};
  stamp_flags_ = first.buffer.flags & (V4L2_BUF_FLAG_TIMESTAMP_MASK | V4L2_BUF_FLAG_TSTAMP_SRC_MASK);
  return {};
}

BufferFault BufferSet::map_drivers_memory(int fd) noexcept {
  for (std::uint32_t i = 0; i < count_; ++i) {
    Argument argument(type_, kind_, i, is_multiplanar_);
    if (const int error = call(fd, VIDIOC_QUERYBUF, &argument.buffer); error != 0) return {"VIDIOC_QUERYBUF", error};
    const std::size_t bytes = is_multiplanar_ ? argument.plane.length : argument.buffer.length;
    const std::int64_t offset = is_multiplanar_ ? argument.plane.m.mem_offset : argument.buffer.m.offset;
    if (const int error = slots_[i].memory.map(bytes, fd, offset); error != 0) return {"mmap", error};
  }
  return {};
}

rt::Result<void> BufferSet::provide_memory(const Agreement& agreement) {
  if (kind_ == Buffers::userptr) {
    for (std::uint32_t i = 0; i < count_; ++i)
      if (const int error = slots_[i].memory.map(agreement.image_bytes, -1, 0); error != 0)
        return rt::Error{rt::ExitCode::failed, "no memory for the frames of a camera: " + std::string(std::strerror(error))};
    return {};
  }
  auto exported = export_buffers(exporter_, count_, agreement);
  if (!exported) return exported.error();
  for (std::uint32_t i = 0; i < count_; ++i) {
    DmaBuffer& buffer = (*exported)[i];
    if (const int error = slots_[i].memory.map(buffer.bytes, buffer.fd.get(), 0); error != 0)
      return rt::Error{rt::ExitCode::device_unavailable, "buffers of " + exporter_ + " cannot be mapped (" +
                                                             std::strerror(error) + "); name another exporter"};
    slots_[i].dmabuf = std::move(buffer.fd);
  }
  return {};
}

/// The CPU's caches and the device's writes are brought together; where they are coherent it costs a system call.
void BufferSet::begin_read(Slot& slot) noexcept {
  if (kind_ != Buffers::dmabuf) return;
  dma_buf_sync argument{DMA_BUF_SYNC_START | DMA_BUF_SYNC_READ};
  slot.is_read = call(slot.dmabuf.get(), DMA_BUF_IOCTL_SYNC, &argument) == 0;
}

void BufferSet::end_read(Slot& slot) noexcept {
  if (!slot.is_read) return;
  dma_buf_sync argument{DMA_BUF_SYNC_END | DMA_BUF_SYNC_READ};
  (void)call(slot.dmabuf.get(), DMA_BUF_IOCTL_SYNC, &argument);
  slot.is_read = false;
}

int BufferSet::queue(int fd, std::uint32_t index) noexcept {
  Argument argument(type_, kind_, index, is_multiplanar_);
  Slot& slot = slots_[index];
  end_read(slot);
  const auto length = static_cast<std::uint32_t>(slot.memory.bytes());
  const auto address = reinterpret_cast<unsigned long>(slot.memory.data());
  if (is_multiplanar_) {
    argument.plane.length = length;
    if (kind_ == Buffers::userptr) argument.plane.m.userptr = address;
    if (kind_ == Buffers::dmabuf) argument.plane.m.fd = slot.dmabuf.get();
  } else {
    argument.buffer.length = length;
    if (kind_ == Buffers::userptr) argument.buffer.m.userptr = address;
    if (kind_ == Buffers::dmabuf) argument.buffer.m.fd = slot.dmabuf.get();
  }
  return call(fd, VIDIOC_QBUF, &argument.buffer);
}

int BufferSet::dequeue(int fd, Filled& filled) noexcept {
  Argument argument(type_, kind_, 0, is_multiplanar_);
  if (const int error = call(fd, VIDIOC_DQBUF, &argument.buffer); error != 0) return error;
  const v4l2_buffer& buffer = argument.buffer;
  if (buffer.index >= count_) return EPROTO;
  filled.index = buffer.index;
  filled.flags = buffer.flags;
  filled.sequence = buffer.sequence;
  filled.stamp = buffer.timestamp;
  Slot& slot = slots_[buffer.index];
  const Mapping& memory = slot.memory;
  const std::size_t begin = is_multiplanar_ ? std::min<std::size_t>(argument.plane.data_offset, memory.bytes()) : 0;
  const std::uint32_t used = is_multiplanar_ ? argument.plane.bytesused : buffer.bytesused;
  const std::size_t end = std::min<std::size_t>(used, memory.bytes());
  filled.bytes = {memory.data() + begin, end > begin ? end - begin : 0};
  begin_read(slot);
  return 0;
}

std::size_t BufferSet::total_bytes() const {
  std::size_t total = 0;
  for (const Slot& slot : slots_) total += slot.memory.bytes();
  return total;
}

std::string BufferSet::description() const {
  std::string text = std::to_string(count_) + " " + name_of(kind_) + " buffers";
  if (kind_ == Buffers::dmabuf) text += " of " + exporter_;
  return text;
}

}  // namespace tactus::hal::v4l2
