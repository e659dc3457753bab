// The buffers of one stream, in any of the three kinds of memory.
//
//   mmap:     the driver's pages, mapped here while the device is open
//   userptr:  this program's pages      } kept when the device goes away, and
//   dmabuf:   an exporter's, mapped here } handed to it again when it is back
#pragma once

#include <sys/time.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "hal/v4l2/negotiation.hpp"
#include "hal/v4l2/v4l2.hpp"
#include "rt/status.hpp"

namespace tactus::hal::v4l2 {

/// Pages mapped into this process, with one owner.
class Mapping {
 public:
  Mapping() = default;
  Mapping(const Mapping&) = delete;
  Mapping& operator=(const Mapping&) = delete;
  ~Mapping() { unmap(); }
  /// fd < 0: pages of this program, there from the start. 0, or the error's number.
  int map(std::size_t bytes, int fd, std::int64_t offset) noexcept;
  void unmap() noexcept;
  [[nodiscard]] std::uint8_t* data() const { return data_; }
  [[nodiscard]] std::size_t bytes() const { return bytes_; }

 private:
  std::uint8_t* data_ = nullptr;
  std::size_t bytes_ = 0;
};

/// One buffer as the driver gave it back.
struct Filled {
  std::uint32_t index = 0;
  std::uint32_t flags = 0;     // V4L2_BUF_FLAG_*
  std::uint32_t sequence = 0;  // the driver's count
  timeval stamp{};
  std::span<const std::uint8_t> bytes;  // what it says it has filled; valid until queued again
};

/// Where an attempt went wrong: the call, and the error's number; call == nullptr: it did not.
struct BufferFault {
  const char* call = nullptr;
  int error = 0;
};

/// Thread-bound. Only the first attach() allocates.
class BufferSet {
 public:
  static constexpr std::uint32_t kBuffersMax = 32;  // the kernel's own limit, VIDEO_MAX_FRAME
  /// One is being read, one filled, and two are for a reader that is late by up to 66 ms at 30 Hz.
  static constexpr std::uint32_t kBuffersWanted = 4;

  BufferSet(Buffers kind, std::string exporter) : kind_(kind), exporter_(std::move(exporter)) {}
  ~BufferSet() { detach(); }
  BufferSet(const BufferSet&) = delete;
  BufferSet& operator=(const BufferSet&) = delete;

  /// Asks the driver for buffers and gives them memory; none is queued. Boot; the error begins with `device`.
  rt::Result<void> attach(int fd, const Agreement& agreement, std::string_view device);
  /// The same for a device that is back. No heap; false: it does not take what it took before.
  bool attach_again(int fd) noexcept;
  void detach() noexcept;

  /// 0, or the error's number.
  int queue(int fd, std::uint32_t index) noexcept;
  int dequeue(int fd, Filled& filled) noexcept;

  [[nodiscard]] std::uint32_t count() const { return count_; }
  [[nodiscard]] std::size_t total_bytes() const;
  /// V4L2_BUF_FLAG_TIMESTAMP_* and TSTAMP_SRC_* as the driver says them of its queue.
  [[nodiscard]] std::uint32_t stamp_flags() const { return stamp_flags_; }
  /// "4 mmap buffers".
  [[nodiscard]] std::string description() const;

 private:
  struct Slot {
    Mapping memory;
    Descriptor dmabuf;
    bool is_read = false;  // between the two syncs of a DMA-BUF
  };

  BufferFault request(int fd, std::uint32_t count) noexcept;
  BufferFault map_drivers_memory(int fd) noexcept;
  rt::Result<void> provide_memory(const Agreement& agreement);
  void begin_read(Slot& slot) noexcept;
  void end_read(Slot& slot) noexcept;

  Buffers kind_;
  std::string exporter_;
  std::uint32_t type_ = 0;
  bool is_multiplanar_ = false;
  std::uint32_t count_ = 0;
  std::uint32_t stamp_flags_ = 0;
  std::array<Slot, kBuffersMax> slots_;
};

}  // namespace tactus::hal::v4l2
