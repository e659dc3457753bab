// Sounds at places in the room, heard by two ears: what goes in are mono clips, what comes out is a stereo stream.
#pragma once

#include <cstdint>
#include <span>

#include "hal/sound.hpp"
#include "hal/transform.hpp"
#include "rt/time.hpp"

namespace tactus::hal {

/// A clip to be heard once.
struct SpatialClip {
  std::span<const float> samples;  // mono at the mixer's rate, in [-1, 1]; copied by play()
  Vec3d position_world_m;
  float gain = 1;                  // at 1 m, before the mixer's own fall with distance
  rt::Duration delay{};            // from the beginning of the next block that is mixed
};

/// Mixes for one listener. Thread-bound. Takes heap memory when clips begin: never called on a thread that must not.
class SpatialMixer {
 public:
  virtual ~SpatialMixer() = default;
  [[nodiscard]] virtual SoundFormat format() const = 0;

  /// Where the ears are: those of a head that looks along the camera's z.
  virtual void set_listener(const T_WorldDepth& T_world_listener) noexcept = 0;
  /// ok | full (every voice sounds; the clip is left out and counted) | unsupported (an empty clip, one that would end
  /// later than the mixer can plan, or numbers that are not finite).
  virtual rt::Status play(const SpatialClip& clip) noexcept = 0;
  /// The next samples.size() / 2 stereo sample frames. ok | device_lost.
  virtual rt::Status mix(std::span<float> samples) noexcept = 0;

  /// Clips that can begin now without being left out.
  [[nodiscard]] virtual int voices_free() const noexcept = 0;
  [[nodiscard]] virtual std::uint64_t clips_left_out() const = 0;
};

}  // namespace tactus::hal
