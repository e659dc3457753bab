#include "hal/openni2/present/frame_buffers.hpp"

#include <cstdlib>

namespace tactus::hal::openni2 {
namespace {

// A cache line: what the library's own allocator promises is 16 bytes.
constexpr std::size_t kAlignBytes = 64;

std::size_t aligned(std::size_t bytes) { return (bytes + kAlignBytes - 1) / kAlignBytes * kAlignBytes; }

void* take_buffer(int bytes, void* cookie) {
  return static_cast<FrameBuffers*>(cookie)->take(static_cast<std::size_t>(bytes > 0 ? bytes : 1));
}

void give_buffer_back(void* buffer, void* cookie) { static_cast<FrameBuffers*>(cookie)->give_back(buffer); }

}  // namespace

FrameBuffers::FrameBuffers(std::size_t buffer_bytes, std::size_t count)
    : buffer_bytes_(aligned(buffer_bytes)), memory_(buffer_bytes_ * count + kAlignBytes) {
  std::uint8_t* first = memory_.data() + (kAlignBytes - reinterpret_cast<std::uintptr_t>(memory_.data()) % kAlignBytes);
  for (std::size_t i = 0; i < count; ++i) free_.push_back(first + i * buffer_bytes_);
}

void FrameBuffers::hand_to(OniStreamHandle stream) {
  (void)oniStreamSetFrameBuffersAllocator(stream, take_buffer, give_buffer_back, this);
}

void* FrameBuffers::take(std::size_t bytes) {
  if (bytes <= buffer_bytes_) {
    const std::lock_guard lock(mutex_);
    if (!free_.empty()) {
      std::uint8_t* buffer = free_.back();
      free_.pop_back();
      return buffer;
    }
  }
  return std::aligned_alloc(kAlignBytes, aligned(bytes));
}

void FrameBuffers::give_back(void* buffer) {
  auto* bytes = static_cast<std::uint8_t*>(buffer);
  if (bytes < memory_.data() || bytes >= memory_.data() + memory_.size()) return std::free(buffer);
  const std::lock_guard lock(mutex_);
  free_.push_back(bytes);
}

}  // namespace tactus::hal::openni2
