// Writes a sensor's frames as an .oni file that OpenNI2 programs play: `tactus convert`. Needs no library.
//
// OpenNI's own recorder takes live streams alone, in real time, and begins each stream's times anew at zero; here the times
// stay, so that depth and colour keep their distance.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>

#include "hal/camera.hpp"
#include "rt/status.hpp"

namespace tactus::hal::openni2 {

/// Lossless: depth and colour uncompressed, 46 MB a second at 640x480. Depth stays as it is where the unit is 1 mm or
/// 0.1 mm; other units become whole millimetres, and what lies beyond 65.534 m "no measurement". Times are cut to whole
/// microseconds. Of the calibration an .oni file keeps the fields of view and whether depth is registered: no principal
/// point, no distortion, no pose between the cameras. Frames that the sensor rejects are left out and stay in its counters.
///
/// Boot phase only (allocates, writes files). Thread-bound. A file that was not finished plays up to its last whole
/// frame.
class OniWriter {
 public:
  /// Creates the file. Errors: bad_usage when it exists, or when the sensor's frames are larger than OpenNI2 reads; failed
  /// when it cannot be written. `sensor` must outlive the writer and is read by it alone.
  static rt::Result<OniWriter> open(const std::filesystem::path& file, Sensor& sensor);
  OniWriter(OniWriter&&) noexcept;
  OniWriter& operator=(OniWriter&&) noexcept;
  ~OniWriter();

  /// Writes the next depth frame, and the colour frames up to its time. False: the sensor is at its end, and the file is
  /// complete. Errors (failed): the file cannot be written; device_unavailable: the device is lost or silent for a second.
  rt::Result<bool> step();

  [[nodiscard]] std::uint64_t depth_frames_count() const;
  [[nodiscard]] std::uint64_t color_frames_count() const;

 private:
  struct State;
  explicit OniWriter(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

struct OniCounts {
  std::uint64_t depth_frames_count = 0, color_frames_count = 0;
};

/// All of it: open, step until the end.
rt::Result<OniCounts> write_oni(const std::filesystem::path& file, Sensor& sensor);

}  // namespace tactus::hal::openni2
