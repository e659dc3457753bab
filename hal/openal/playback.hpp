// The default loudspeaker, by OpenAL Soft: a short queue of samples that a device plays at its own pace.
#pragma once

#include <cstdint>
#include <memory>

#include "hal/sound.hpp"
#include "rt/status.hpp"

namespace tactus::hal::openal {

struct PlaybackConfig {
  int buffers_count = 10;  // of buffer_frames each; 100 ms hold three video frames of sound less what plays
  int buffer_frames = 480;
  /// The device begins, and begins again after it has run dry, once so many wait: more than one video frame's
  /// 33 ms, or it would run dry before the next comes.
  int buffers_before_start = 5;
};

/// Streams 48 kHz stereo. A write is cut into buffers of buffer_frames; the device returns whole buffers.
/// What OpenAL itself holds comes on top (three periods of 10 ms where the driver grants it). OpenAL plays on
/// a thread of its own.
class Playback final : public SoundSink {
 public:
  /// Errors: device_unavailable (no sound card, no OpenAL), bad_usage (a queue of no size); one sentence
  /// each. Boot.
  static rt::Result<Playback> create(const PlaybackConfig& config = {});

  Playback(Playback&&) noexcept;
  Playback& operator=(Playback&&) = delete;
  ~Playback() override;  // what is queued is not waited for

  [[nodiscard]] SoundFormat format() const override { return {48000, 2}; }
  /// Also `unsupported` when `samples` is longer than the whole queue. Copies into OpenAL's memory: takes
  /// heap.
  rt::Status write(std::span<const float> samples) noexcept override;
  [[nodiscard]] std::uint64_t sample_frames_written() const override;

  /// Times the device ran dry after it had begun: each is a gap that was heard.
  [[nodiscard]] std::uint64_t underruns() const;

 private:
  struct State;
  explicit Playback(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace tactus::hal::openal
