// One capture node while it runs: frames one at a time from the driver's buffers, and what is done when it goes away.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "hal/camera.hpp"
#include "hal/v4l2/buffers.hpp"
#include "hal/v4l2/controls.hpp"
#include "hal/v4l2/frame_order.hpp"
#include "hal/v4l2/negotiation.hpp"
#include "hal/v4l2/node.hpp"
#include "hal/v4l2/uvc_metadata.hpp"
#include "hal/v4l2/uvc_stamp.hpp"
#include "rt/status.hpp"

namespace tactus::hal::v4l2 {

/// Thread-bound. After open() no heap call, also when the device is lost and comes back.
class LiveDevice {
 public:
  LiveDevice(Buffers kind, std::string exporter) : buffers_(kind, std::move(exporter)) {}
  LiveDevice(const LiveDevice&) = delete;
  LiveDevice& operator=(const LiveDevice&) = delete;

  /// Opens, negotiates, sets the controls and starts the stream. Boot.
  rt::Result<void> open(const V4l2Request& request, Stream stream);

  /// Holds the next good frame, or the one held already: frame() has it until release(). As DepthCamera::read.
  rt::Status acquire(rt::Duration timeout);
  [[nodiscard]] const RawFrame& frame() const { return frame_; }
  /// Gives the buffer back to the driver and counts the frame as what became of it: ok, or corrupt.
  void release(rt::Status outcome);

  [[nodiscard]] const CameraCounters& counters() const { return counters_; }
  [[nodiscard]] const Agreement& agreement() const { return agreement_; }
  [[nodiscard]] bool has_host_clock() const { return has_host_clock_; }
  [[nodiscard]] std::size_t buffers_bytes() const { return buffers_.total_bytes(); }
  [[nodiscard]] std::string description() const;
  /// One sentence: what FrameHeader::time is.
  [[nodiscard]] std::string time_note() const;

 private:
  /// 0, or the error's number, with the call that failed in `what`.
  int start_stream(const char*& what) noexcept;
  void start_metadata() noexcept;
  bool open_again() noexcept;
  rt::Status look_again(rt::HostTime deadline);
  /// False: the driver takes no buffer back any more.
  bool give_back(std::uint32_t index) noexcept;
  bool give_back_refused() noexcept;
  void pass_over_stale_frames() noexcept;
  rt::Status wait(rt::HostTime deadline) noexcept;
  /// ok: held. skipped: passed over, the next may do. corrupt: rejected.
  rt::Status take(const Filled& filled);
  rt::Status reject(const Filled& filled, std::uint64_t sequence, const char* why);
  rt::Status lose() noexcept;
  void say(std::uint64_t sequence, const char* why);

  NodePath path_{};
  NodeInfo info_;
  Descriptor node_;
  BufferSet buffers_;
  UvcMetadata metadata_;
  Agreement agreement_;
  std::vector<ControlValue> controls_;
  bool has_monotonic_stamps_ = true;  // false: its stamps are on the wall clock, whatever their flags say
  bool has_host_clock_ = false;

  CameraCounters counters_;
  FrameOrder order_;
  DeviceClock clock_;
  CaptureClock capture_clock_;
  rt::SensorTime last_time_;
  bool has_last_time_ = false;
  RawFrame frame_;
  bool is_held_ = false;
  std::uint32_t held_index_ = 0;
  std::uint32_t refused_ = 0;  // bit i: buffer i is ours because the driver would not take it
  bool has_begun_ = false;
  rt::HostTime next_look_;
};

}  // namespace tactus::hal::v4l2
