// Writes video.mp4: H.264 pictures and AAC sound, by libav where it was built in.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>

#include "hal/sound.hpp"
#include "rt/status.hpp"

namespace tactus::hal {

/// MPEG-4 part 2 where libavcodec was built without x264 (its licence is the GPL): larger, but plays.
inline constexpr std::array<const char*, 2> kPictureEncoders{"libx264", "mpeg4"};

struct MovieFormat {
  int width_px = 0, height_px = 0;  // even numbers: colour has half of the resolution
  double frame_rate_hz = 30;        // 1 to 1000
  SoundFormat sound = {};           // channels_count 0: a silent film; otherwise 2
  // libavcodec's names; the first one there is.
  std::span<const char* const> picture_encoders = kPictureEncoders;
};

/// One film being written. Thread-bound; allocates and writes files at any time, so never called on a
/// real-time thread. The same calls give the same bytes on the same machine.
class MovieWriter {
 public:
  /// device_unavailable: no encoder here (not built in, or none of picture_encoders), bad_usage: an odd size
  /// or no size, a rate or a sound that cannot be written, failed: the file cannot be made; one sentence
  /// each. Boot.
  static rt::Result<MovieWriter> create(const std::filesystem::path& file, const MovieFormat& format);

  MovieWriter(MovieWriter&&) noexcept;
  MovieWriter& operator=(MovieWriter&&) = delete;
  ~MovieWriter();  // a film that was not closed is closed silently

  /// Picture number `index`, width * height * 3 bytes from the top, shown at index / frame_rate_hz. Indices
  /// rise; one left out leaves its predecessor standing.
  void write_picture(std::uint64_t index, std::span<const std::uint8_t> rgb);
  /// The sound goes on from where it was: interleaved samples in [-1, 1], whole sample frames. A silent film
  /// takes none.
  void write_sound(std::span<const float> samples);
  /// Writes the rest. Sound and pictures end together: silence is added, or the last picture stands. `failed`
  /// when anything went wrong since create (disk full) or there was no picture. Once.
  rt::Result<void> close();

 private:
  struct State;
  explicit MovieWriter(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace tactus::hal
