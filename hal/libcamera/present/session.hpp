// One time that a camera is open: its requests, made once and reused, and its buffers, mapped once.
//
//   libcamera's thread  --index of a completed request-->  [ring of 2]  --take()-->  reading thread
//          ^                                                  | full: the oldest                |
//          +--------------------- queued again <--------------+---------- give_back() <---------+
//
// A request belongs to the camera from queueing to completion, then to the ring, then to the reader. A frame's pixels stay
// in the device's buffer all the while. With libcamera's 4 buffers, 2 waiting and 1 being read leave 1 to the device.
#pragma once

#include <libcamera/libcamera.h>

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hal/libcamera/present/controls.hpp"
#include "hal/libcamera/present/formats.hpp"
#include "hal/libcamera/present/wake.hpp"
#include "hal/raw_frame.hpp"
#include "rt/drop_oldest_ring.hpp"
#include "rt/status.hpp"

namespace tactus::hal::libcamera {

/// What is negotiated at the first opening and asked for again when the camera is back.
struct Mode {
  FormatChoice choice;
  std::vector<ControlSetting> controls;
};

/// Takes the camera for this process; empty, or why not.
std::string acquire(lc::Camera& camera);

class Session {
 public:
  struct Frame {
    bool is_good = false;          // libcamera had no error to tell
    std::uint32_t sequence = 0;    // from 0 at each opening
    rt::SensorTime time;
    rt::HostTime arrived;
    std::size_t used_bytes = 0;
  };

  /// device_unavailable: in use, or it failed on the way. libcamera's thread, as the destructor and everything that is not
  /// marked. `wake` is told of every frame and of the loss, and outlives the session.
  static rt::Result<std::unique_ptr<Session>> open(std::shared_ptr<lc::Camera> camera, const Mode& mode, Wake& wake);
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  /// The oldest completed request, now the reader's. Reading thread, lock-free.
  std::optional<std::uint32_t> take() noexcept { return consumer_.try_pop(); }
  /// Valid while the request is the reader's. Reading thread.
  [[nodiscard]] const Frame& frame(std::uint32_t index) const { return slots_[index].frame; }
  /// The same as a RawFrame without its header; between begin_access and end_access the processor sees the pixels.
  [[nodiscard]] RawFrame raw(std::uint32_t index) const;
  void begin_access(std::uint32_t index) const noexcept;
  void end_access(std::uint32_t index) const noexcept;
  /// To the camera again. Whoever owns the request; libcamera allocates a message.
  void give_back(std::uint32_t index);
  /// The camera was unplugged, or takes no buffers any more. Any thread.
  [[nodiscard]] bool is_lost() const noexcept {
    // Pairs with the releases in lose(): what was set before is seen.
    return is_lost_.load(std::memory_order_acquire);
  }
  /// The first request, which carries the controls, came back. Any thread. Nothing: not yet.
  [[nodiscard]] std::optional<bool> controls_taken() const noexcept;

  [[nodiscard]] bool is_disconnected() const { return is_disconnected_; }
  [[nodiscard]] std::size_t requests_count() const { return slots_.size(); }
  [[nodiscard]] std::size_t buffers_bytes() const;

 private:
  struct Slot {
    std::unique_ptr<lc::Request> request;
    void* mapping = nullptr;
    std::size_t mapping_bytes = 0, offset = 0, frame_bytes = 0;
    int fd = -1;  // of the dma-buf, libcamera's
    Frame frame;
  };
  enum class Controls : int { pending, taken, refused };

  Session(std::shared_ptr<lc::Camera> camera, Wake& wake);
  /// Empty, or why not.
  std::string configure(const FormatChoice& choice);
  std::string make_requests();
  std::string map(const lc::FrameBuffer& buffer, Slot& slot) const;
  std::string start(const std::vector<ControlSetting>& controls);
  void on_completed(lc::Request* request);
  void on_disconnected();
  void lose() noexcept;

  std::shared_ptr<lc::Camera> camera_;
  Wake& wake_;
  PixelFormat format_ = PixelFormat::rgb24;
  int width_ = 0, height_ = 0;
  std::size_t row_bytes_ = 0;
  lc::Stream* stream_ = nullptr;
  std::unique_ptr<lc::FrameBufferAllocator> allocator_;
  std::vector<Slot> slots_;
  rt::DropOldestRing<std::uint32_t, 2> ring_;
  rt::DropOldestRing<std::uint32_t, 2>::Producer producer_;
  rt::DropOldestRing<std::uint32_t, 2>::Consumer consumer_;
  std::atomic<bool> is_lost_{false};
  std::atomic<Controls> controls_{Controls::pending};
  bool is_acquired_ = false, is_closing_ = false, is_disconnected_ = false;  // libcamera's thread
};

}  // namespace tactus::hal::libcamera
