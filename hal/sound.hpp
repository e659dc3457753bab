// Where sound goes: a loudspeaker, a file, or nowhere.
#pragma once

#include <cstdint>
#include <span>

#include "rt/status.hpp"

namespace tactus::hal {

struct SoundFormat {
  int sample_rate_hz = 48000;
  int channels_count = 2;
};

/// A stream of interleaved float samples in [-1, 1]. Thread-bound: one thread writes.
class SoundSink {
 public:
  virtual ~SoundSink() = default;
  [[nodiscard]] virtual SoundFormat format() const = 0;

  /// Takes all of `samples` (a whole number of sample frames: channels_count values each) or none of them.
  /// ok | full (the device has not played what it has; counted by the caller) | device_lost. Step.
  virtual rt::Status write(std::span<const float> samples) noexcept = 0;

  /// Sample frames taken since the sink was opened.
  [[nodiscard]] virtual std::uint64_t sample_frames_written() const = 0;
};

}  // namespace tactus::hal
