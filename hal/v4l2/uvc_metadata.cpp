#include "hal/v4l2/uvc_metadata.hpp"

#include <linux/videodev2.h>

#include <algorithm>
#include <charconv>
#include <string_view>

#include "hal/v4l2/uvc_stamp.hpp"

namespace tactus::hal::v4l2 {
namespace {

/// The clock's rate by the descriptors of the USB device behind the node; "device" is the video control interface.
std::uint32_t clock_rate_hz(int video_fd) noexcept {
  std::array<char, 8> number;
  const std::string_view text = read_beside(video_fd, "device/bInterfaceNumber", number);
  int interface = -1;
  (void)std::from_chars(text.data(), text.data() + text.size(), interface, 16);
  // Configurations of video devices reach a few kilobytes; the control interface comes first.
  std::array<char, 4096> raw;
  const std::string_view descriptors = read_beside(video_fd, "device/../descriptors", raw);
  return uvc_clock_hz({reinterpret_cast<const std::uint8_t*>(descriptors.data()), descriptors.size()}, interface);
}

}  // namespace

bool UvcMetadata::start(int video_fd, const NodeInfo& video) noexcept {
  stop();
  if (std::string_view(video.driver.data()) != "uvcvideo" || video.index < 0) return false;
  clock_hz_ = clock_rate_hz(video_fd);
  if (clock_hz_ == 0) return false;
  // uvcvideo registers the metadata node of a stream right after its image node.
  NodeInfo wanted = video;
  wanted.index = video.index + 1;
  NodePath path;
  node_ = find_node(wanted, &NodeInfo::is_metadata, path);
  if (node_.is_open() && !set_up()) stop();
  return node_.is_open();
}

void UvcMetadata::stop() noexcept {
  node_.close();
  for (Mapping& memory : memory_) memory.unmap();
  count_ = 0;
  pending_.reset();
}

bool UvcMetadata::set_up() noexcept {
  v4l2_format format{};
  format.type = V4L2_BUF_TYPE_META_CAPTURE;
  format.fmt.meta.dataformat = V4L2_META_FMT_UVC;
  if (call(node_.get(), VIDIOC_S_FMT, &format) != 0 || format.fmt.meta.dataformat != V4L2_META_FMT_UVC) return false;
  v4l2_requestbuffers ask{};
  ask.count = kBuffersWanted;
  ask.type = V4L2_BUF_TYPE_META_CAPTURE;
  ask.memory = V4L2_MEMORY_MMAP;
  if (call(node_.get(), VIDIOC_REQBUFS, &ask) != 0 || ask.count == 0) return false;
  count_ = std::min(ask.count, kBuffersWanted);
  for (std::uint32_t i = 0; i < count_; ++i) {
    v4l2_buffer buffer{};
    buffer.type = V4L2_BUF_TYPE_META_CAPTURE;
    buffer.memory = V4L2_MEMORY_MMAP;
    buffer.index = i;
    if (call(node_.get(), VIDIOC_QUERYBUF, &buffer) != 0) return false;
    if (memory_[i].map(buffer.length, node_.get(), buffer.m.offset) != 0) return false;
    if (!queue(i)) return false;
  }
  int type = V4L2_BUF_TYPE_META_CAPTURE;
  return call(node_.get(), VIDIOC_STREAMON, &type) == 0;
}

bool UvcMetadata::queue(std::uint32_t index) noexcept {
  v4l2_buffer buffer{};
  buffer.type = V4L2_BUF_TYPE_META_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  buffer.index = index;
  return call(node_.get(), VIDIOC_QBUF, &buffer) == 0;
}

bool UvcMetadata::fetch() noexcept {
  v4l2_buffer buffer{};
  buffer.type = V4L2_BUF_TYPE_META_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  if (call(node_.get(), VIDIOC_DQBUF, &buffer) != 0 || buffer.index >= count_) return false;
  const Mapping& memory = memory_[buffer.index];
  const std::size_t bytes = std::min<std::size_t>(buffer.bytesused, memory.bytes());
  pending_ = Pending{buffer.sequence, capture_begin_ns({memory.data(), bytes}, clock_hz_)};
  (void)queue(buffer.index);
  return true;
}

std::optional<std::int64_t> UvcMetadata::capture_begin(std::uint32_t sequence) noexcept {
  if (!node_.is_open()) return std::nullopt;
  while (pending_ || fetch()) {
    const std::uint32_t behind = sequence - pending_->sequence;
    if (behind >= 1U << 31) return std::nullopt;  // that of a later frame; it waits for it
    const auto begin_ns = pending_->begin_ns;
    pending_.reset();
    if (behind == 0) return begin_ns;
  }
  return std::nullopt;
}

}  // namespace tactus::hal::v4l2
