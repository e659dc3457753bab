// The metadata node beside a USB camera's image node: begins of exposure, by the driver's frame number.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "hal/v4l2/buffers.hpp"
#include "hal/v4l2/node.hpp"

namespace tactus::hal::v4l2 {

/// Thread-bound; makes no heap call at all. What goes wrong here only costs precision: nothing is answered then.
class UvcMetadata {
 public:
  UvcMetadata() = default;
  ~UvcMetadata() { stop(); }
  UvcMetadata(const UvcMetadata&) = delete;
  UvcMetadata& operator=(const UvcMetadata&) = delete;

  /// Before the image node's buffers are asked for. False: the camera has none, or not in a form known here.
  bool start(int video_fd, const NodeInfo& video) noexcept;
  void stop() noexcept;
  [[nodiscard]] bool is_running() const { return node_.is_open(); }

  /// For the frame that the driver numbers `sequence`; numbers must rise. Older metadata is passed over. Does not wait: the
  /// driver completes a frame's metadata before the frame.
  std::optional<std::int64_t> capture_begin(std::uint32_t sequence) noexcept;

 private:
  // Twice the image buffers: of frames that the image queue had no room for, there is metadata all the same.
  static constexpr std::uint32_t kBuffersWanted = 2 * BufferSet::kBuffersWanted;

  bool set_up() noexcept;
  bool queue(std::uint32_t index) noexcept;
  /// The next block of metadata, into pending_. False: none yet.
  bool fetch() noexcept;

  struct Pending {
    std::uint32_t sequence = 0;
    std::optional<std::int64_t> begin_ns;
  };

  Descriptor node_;
  std::uint32_t clock_hz_ = 0;
  std::array<Mapping, kBuffersWanted> memory_;
  std::uint32_t count_ = 0;
  std::optional<Pending> pending_;
};

}  // namespace tactus::hal::v4l2
