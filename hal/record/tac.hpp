// Recordings in one file (.tac): the sensor that plays one, and what is known of one without playing it. chunk.hpp has the
// form of the file, tac_writer.hpp writes it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "hal/camera.hpp"
#include "rt/status.hpp"

namespace tactus::hal::record {

/// Free words of whoever records: source, command, revision, configuration. Kept in their order; bytes that are no UTF-8
/// become '?'.
struct TacInfo {
  std::vector<std::pair<std::string, std::string>> entries;
  friend bool operator==(const TacInfo&, const TacInfo&) = default;
};

struct TacReadOptions {
  /// Depth frames with sequence numbers [first, last) are played, with the colour frames within 20 ms of them.
  std::uint64_t first = 0;
  std::uint64_t last = std::numeric_limits<std::uint64_t>::max();
  /// Frames that a thread per camera decodes ahead; 0: read() decodes itself, which touches the heap for JPEG alone.
  std::size_t prefetch = 0;
};

/// Opens a recording, whole or cut off anywhere. Frames come as they were taken: times, numbers and arrivals of the live
/// run, pixels through hal/frames as there, and a tap is shown what was recorded. A frame whose bytes do not fit their
/// checksum is corrupt and counted; a tail that a power cut left is a sentence in Sensor::notes. Errors: bad_input, one
/// sentence naming the file; bad_usage, the range holds no frame. Boot; any thread.
rt::Result<Sensor> open_tac(const std::filesystem::path& path, const TacReadOptions& options);

/// Whether the file begins like a recording of any version.
bool is_tac(const std::filesystem::path& path);

/// What a recording holds, from its index or the headers of its chunks.
struct TacFacts {
  struct OfStream {
    std::uint64_t frames = 0;
    std::uint64_t missing = 0;       // numbers left out between the first frame and the last
    std::uint64_t raw_bytes = 0;     // as the device gave them, without padding
    std::uint64_t stored_bytes = 0;  // in the file, without the chunks' headers
    std::uint64_t dropped = 0;       // by the recorder, and refused by it; 0 when the recording was cut off: unknown
    std::uint64_t refused = 0;
    std::optional<PixelFormat> format;  // of the first frame
    rt::SensorTime first_time, last_time;
    /// 0 without frames.
    [[nodiscard]] double ratio() const {
      return stored_bytes == 0 ? 0 : static_cast<double>(raw_bytes) / static_cast<double>(stored_bytes);
    }
  };
  std::string description;  // of the sensor that was recorded
  RigCalibration calibration;
  double frame_rate_hz = 0;
  bool was_live = false, has_two_clocks = false;
  std::optional<Vec3d> gravity_depth;
  TacInfo info;
  std::uint64_t file_bytes = 0, chunks_count = 0;
  std::array<OfStream, 2> streams;  // by Stream
  std::uint64_t labels_count = 0, poses_count = 0;
  bool is_cut_off = false;           // it has no regular end
  std::uint64_t damaged_bytes = 0;   // belong to no chunk, the torn tail of one that was cut off included
  std::vector<std::string> notes;    // one sentence each
};
/// Reads no pixels. Errors as open_tac. Boot.
rt::Result<TacFacts> tac_facts(const std::filesystem::path& path);

}  // namespace tactus::hal::record
