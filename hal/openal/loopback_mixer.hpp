// Two ears by OpenAL Soft's HRTF, mixed into memory: no sound card, no clock, no mixing thread of its own.
#pragma once

#include <cstdint>
#include <memory>

#include "hal/spatial_mixer.hpp"
#include "rt/status.hpp"

namespace tactus::hal::openal {

struct LoopbackConfig {
  int voices_count = 64;  // clips that sound at once, those that wait for their delay included; 1 .. 256
  bool use_hrtf = true;   // false: two loudspeakers, panned
};

/// Mixes 48 kHz stereo through a loopback device (ALC_SOFT_loopback) of its own. The same calls give the same
/// bits on one machine: nothing but alcRenderSamplesSOFT moves time, on the calling thread.
///
/// A clip begins at its sample: its delay is put before it as zeros. Mixing in pieces that end where clips
/// begin would do it without them, but 60 reflections would cut a block into 60 pieces, and what one clip
/// sounds like (gains are ramped over a piece) would depend on when others begin. A waiting voice costs as
/// much as a sounding one.
///
/// Loudness falls with 1 / distance, not closer than 0.2 m; gain / distance is held at 5. Samples beyond 0.8
/// are bent smoothly to stay within 1 and counted.
class LoopbackMixer final : public SpatialMixer {
 public:
  /// Errors: device_unavailable (no OpenAL loopback device, or not enough sources), bad_usage (voices_count).
  /// A library without HRTF is no error: has_hrtf() says it and sound is panned. Boot.
  static rt::Result<LoopbackMixer> create(const LoopbackConfig& config = {});

  LoopbackMixer(LoopbackMixer&&) noexcept;
  LoopbackMixer& operator=(LoopbackMixer&&) = delete;
  ~LoopbackMixer() override;

  [[nodiscard]] SoundFormat format() const override { return {48000, 2}; }
  void set_listener(const T_WorldDepth& T_world_listener) noexcept override;
  rt::Status play(const SpatialClip& clip) noexcept override;
  rt::Status mix(std::span<float> samples) noexcept override;
  [[nodiscard]] int voices_free() const noexcept override;
  [[nodiscard]] std::uint64_t clips_left_out() const override;

  [[nodiscard]] bool has_hrtf() const;
  [[nodiscard]] std::uint64_t samples_limited() const;

 private:
  struct State;
  explicit LoopbackMixer(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace tactus::hal::openal
