// Plays a sensor's frames at the times that they have, as a device would.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "firmware_host/openni2_driver/settings.hpp"
#include "hal/camera.hpp"
#include "rt/time.hpp"

namespace tactus::openni2_driver {

/// Where one stream's frames go. Called by the player's thread.
class FrameSink {
 public:
  virtual ~FrameSink() = default;
  virtual void show(std::span<const std::uint8_t> pixels, std::uint64_t time_us, int index) = 0;
};

/// Depth in whole millimetres (what lies beyond kDepthMax_mm is no measurement) and colour in RGB, in the order of their
/// times, from the first start to the last stop of a stream. Times are the source's, cut to microseconds; numbers are its
/// sequence numbers and begin at 1. start() and stop() on any thread.
class SourcePlayer {
 public:
  // What viewers make their histograms for, and what Kinects reach.
  static constexpr int kDepthMax_mm = 10000;

  SourcePlayer(hal::Sensor sensor, Settings settings);
  ~SourcePlayer();

  [[nodiscard]] const hal::Sensor& sensor() const { return sensor_; }

  void start(hal::Stream stream, FrameSink& sink);
  /// When it returns, the sink is shown nothing more.
  void stop(hal::Stream stream);
  /// Depth and colour within 20 ms of each other come together, under depth's number; others do not come at all.
  void set_synced(bool is_synced);
  /// No more frames, ever.
  void unplug();

 private:
  struct Track {
    FrameSink* sink = nullptr;
    std::vector<std::uint8_t> pixels;
    std::int64_t time_us = 0;
    int index = 0;
    bool is_filled = false, has_ended = false;
  };
  void play();
  void fill_depth();
  void fill_color();
  void note(Track& track, const hal::FrameHeader& header);
  bool rewind();
  /// False: stopped meanwhile.
  bool wait_until_due(std::unique_lock<std::mutex>& lock, std::int64_t time_us);
  static void show(Track& track, int index);
  [[nodiscard]] bool is_running() const { return !is_unplugged_ && (depth_.sink != nullptr || color_.sink != nullptr); }

  hal::Sensor sensor_;
  Settings settings_;
  std::vector<std::uint16_t> raw_;
  std::int64_t shift_us_ = 0, last_us_ = 0, begin_us_ = 0;
  int index_shift_ = 0, last_index_ = 0;
  rt::HostTime begin_;
  bool has_begun_ = false;

  std::mutex mutex_;  // guards what both the player's thread and the library's calls touch
  std::condition_variable changed_;
  Track depth_, color_;
  bool is_synced_ = false, is_unplugged_ = false;
  std::thread thread_;
};

}  // namespace tactus::openni2_driver
