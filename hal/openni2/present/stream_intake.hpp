// What lies between the library, which brings frames on its thread, and a reader on another: the newest few frames of one
// stream, held in our buffers.
#pragma once

#include <array>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <vector>

#include "hal/openni2/present/frame_buffers.hpp"
#include "hal/openni2/present/library.hpp"
#include "hal/raw_frame.hpp"
#include "rt/status.hpp"

namespace tactus::hal::openni2 {

/// A device's clock across its absences: one that begins anew goes on from where it was, by the time that passed here.
/// The library's thread's.
class DeviceClock {
 public:
  void begin_connection() { is_first_ = true; }
  rt::SensorTime at(std::uint64_t device_us, rt::HostTime arrived);

 private:
  std::int64_t offset_ns_ = 0;
  rt::SensorTime last_;
  rt::HostTime last_arrived_;
  bool has_last_ = false, is_first_ = false;
};

class StreamIntake final : public StreamTaker {
 public:
  struct Frame {
    OniFrame* frame = nullptr;
    FrameHeader header;
  };

  /// Boot; allocates the buffers. `clock` is the device's.
  StreamIntake(DeviceClock& clock, std::size_t frame_bytes);
  /// After disconnect(), on the library's thread.
  ~StreamIntake() override;

  [[nodiscard]] FrameBuffers& buffers() { return buffers_; }

  // The library's thread:
  void connect();
  /// Gives all frames back but the reader's.
  void disconnect();
  void take(OniFrame* frame, rt::HostTime arrived) override;
  void release_spent() override;

  // Any thread:
  /// From now on the reader is told that the device is away, until connect().
  void lose();

  // The reader's thread; no heap:
  [[nodiscard]] bool has_front() const { return front_.frame != nullptr; }
  /// ok: front() is there | timeout | device_lost.
  rt::Status await(rt::Duration timeout);
  [[nodiscard]] const Frame& front() const { return front_; }
  /// Passes over what came before anybody read, but for the newest frame: a program may boot for half a second meanwhile.
  void pass_over_old();
  /// The front frame goes back to the library, later and by its own thread.
  void done();
  [[nodiscard]] std::uint64_t losses();

 private:
  // A reader that is late by more finds frames missing: as old as these, 130 ms at 30 Hz, they are of no use to it.
  static constexpr std::size_t kHeld = 4;
  // Those, the reader's, one that goes back, three that the library keeps for synchronised pairs, three being filled.
  static constexpr std::size_t kBuffers = kHeld + 8;

  DeviceClock& clock_;
  FrameBuffers buffers_;
  Frame front_;  // the reader's

  std::mutex mutex_;  // guards what follows; never held during a call into the library
  std::condition_variable came_;
  std::array<Frame, kHeld> held_;
  std::size_t held_first_ = 0, held_count_ = 0;
  std::array<OniFrame*, kHeld + 1> spent_{};
  std::size_t spent_count_ = 0;
  bool is_away_ = false;
  std::uint64_t losses_ = 0;

  // The library's thread's.
  bool is_first_ = true, has_last_ = false;
  std::int64_t sequence_offset_ = 0;
  std::uint64_t last_sequence_ = 0;
};

}  // namespace tactus::hal::openni2
