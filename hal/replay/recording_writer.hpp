// Writes a sensor's frames as a folder that open_replay reads: `tactus convert` and `tactus record`.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>

#include "hal/camera.hpp"
#include "rt/status.hpp"

namespace tactus::hal {

enum class RecordingLayout : std::uint8_t { tum, seven_scenes };
enum class ColorEncoding : std::uint8_t { png, jpeg };

struct RecordingOptions {
  RecordingLayout layout = RecordingLayout::tum;
  ColorEncoding color = ColorEncoding::jpeg;
  int jpeg_quality = 95;
  bool write_labels = true;  // when the sensor knows them
};

/// Copies one sensor's streams into a folder, one depth frame and its colour per step.
///
/// TUM layout: depth values as they are (byte-exact), every colour frame with its own time, times to the
/// nanosecond, true poses, label/, gravity.txt, calibration.toml when intrinsics.txt cannot say all of it.
/// 7-Scenes layout: depth in whole millimetres (exact when the sensor's unit is 1 mm, else rounded;
/// beyond 65.534 m becomes "no measurement"), frames named by sequence number, so times become number / 30
/// Hz; each depth frame takes the colour frame nearest within 20 ms and true poses likewise; calibration
/// always as calibration.toml, gravity.txt. Both: frames that the sensor rejects are left out and stay in its
/// counters.
///
/// Boot phase only (allocates, writes files). Thread-bound. The lists grow with every frame, so that a
/// recording cut short can be read up to there.
class RecordingWriter {
 public:
  /// Creates the folder. Errors: bad_usage when it exists and is not empty; failed when it cannot be written.
  /// `sensor` must outlive the writer and is read by it alone.
  static rt::Result<RecordingWriter> open(const std::filesystem::path& directory, Sensor& sensor,
                                          const RecordingOptions& options);
  RecordingWriter(RecordingWriter&&) noexcept;
  RecordingWriter& operator=(RecordingWriter&&) noexcept;
  ~RecordingWriter();

  /// Writes the next frame. False: the sensor is at its end, and every file is complete. Errors: a file
  /// cannot be written; the device is lost or silent for a second.
  rt::Result<bool> step();

  [[nodiscard]] std::uint64_t depth_frames_count() const;
  [[nodiscard]] std::uint64_t color_frames_count() const;

 private:
  struct State;
  explicit RecordingWriter(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// All of it: open, step until the end. Returns the number of depth frames written.
rt::Result<std::uint64_t> write_recording(const std::filesystem::path& directory, Sensor& sensor,
                                          const RecordingOptions& options);

}  // namespace tactus::hal
