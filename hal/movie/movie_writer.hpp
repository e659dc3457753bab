// Writes video.mp4: H.264 pictures and AAC sound, by libav where it was built in.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>

#include "hal/sound.hpp"
#include "rt/status.hpp"

namespace tactus::hal {

struct MovieFormat {
  int width_px = 0, height_px = 0;  // even numbers
  double frame_rate_hz = 30;
  SoundFormat sound;                // channels_count 0: a silent film
};

/// One film being written. Thread-bound; allocates and writes files at any time, so never called on a real-time thread.
class MovieWriter {
 public:
  /// device_unavailable: no encoder here (not built in, or libavcodec has no H.264), bad_usage: an odd size or no size,
  /// failed: the file cannot be made; one sentence each.
  static rt::Result<MovieWriter> create(const std::filesystem::path& file, const MovieFormat& format);

  MovieWriter(MovieWriter&&) noexcept;
  MovieWriter& operator=(MovieWriter&&) = delete;
  ~MovieWriter();  // a film that was not closed is closed silently

  /// Picture number `index`, width * height * 3 bytes from the top, shown at index / frame_rate_hz. Indices rise; one left
  /// out leaves its predecessor standing.
  void write_picture(std::uint64_t index, std::span<const std::uint8_t> rgb);
  /// The sound goes on from where it was: interleaved samples in [-1, 1].
  void write_sound(std::span<const float> samples);
  /// Writes the rest; `failed` when anything went wrong since create (disk full).
  rt::Result<void> close();

 private:
  struct State;
  explicit MovieWriter(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace tactus::hal
