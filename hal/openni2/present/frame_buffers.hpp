// The memory that a device's driver writes its frames into: ours, taken when the stream is opened.
#pragma once

#include <OniCAPI.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

namespace tactus::hal::openni2 {

/// Any thread; outlives the stream that it is handed to.
class FrameBuffers {
 public:
  /// Allocates and touches `count` buffers. Boot.
  FrameBuffers(std::size_t buffer_bytes, std::size_t count);
  FrameBuffers(const FrameBuffers&) = delete;
  FrameBuffers& operator=(const FrameBuffers&) = delete;

  /// Before the stream starts.
  void hand_to(OniStreamHandle stream);
  /// A driver that asks for larger frames, or keeps more of them than there are, gets memory from the heap, since several
  /// drivers do not look whether they were given any.
  void* take(std::size_t bytes);
  void give_back(void* buffer);

  [[nodiscard]] std::size_t bytes() const { return memory_.size(); }

 private:
  std::size_t buffer_bytes_;
  std::vector<std::uint8_t> memory_;
  std::mutex mutex_;  // guards free_
  std::vector<std::uint8_t*> free_;
};

}  // namespace tactus::hal::openni2
