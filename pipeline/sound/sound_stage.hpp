// The sound stage: impacts of virtual things become clips at places in the room, and a block for two ears.
//
//   inputs    Impacts of the block's time, the listener's pose, the labelled map (rays), a hal::SpatialMixer
//   outputs   one block of interleaved stereo, as long as the video frame it belongs to
//   budget    0.2 to 1 ms for each sound that begins, by how long it rings, its reflections included; the
//             mixer takes 0.1 ms a block of 33 ms and 16 us a voice (tests/pipeline/sound, latency)
//   memory    one planned slice, 0.25 MB, and no heap of its own; but the MIXER TAKES HEAP when clips begin:
//             step() runs on a thread outside the heap guard, never on the spine
//   late      nothing waits: a block is mixed with what has come
//   full      the loudest impacts win, as heard where the listener is, and the rest are counted; reflections
//             are left out before sounds are
//   lost      the mixer's device_lost is passed on; waiting impacts are gone with their block
//
// A contact is heard at its own sample: its delay in the block plus the way through the air. So a sound
// starts within one video frame of its picture, up to the head's own 0.3 ms and the distance's 3 ms a metre.
#pragma once

#include <cstdint>
#include <span>

#include "hal/spatial_mixer.hpp"
#include "hal/transform.hpp"
#include "pipeline/contact/materials.hpp"
#include "pipeline/sound/room_sound.hpp"
#include "rt/slice.hpp"
#include "rt/status.hpp"
#include "rt/time.hpp"

namespace tactus::sound {

/// One impact; plain data, fit for a ring between threads.
struct Impact {
  rt::Duration delay;  // from the beginning of the block; held within 0 .. 1 s
  Vec3d position_world_m;
  Vec3d normal_world;   // towards free space; zero where unknown
  double energy_j = 0;  // what the impact took from the motion; 0: from impulse and speed
  double impulse_n_s = 0;
  double impact_speed_m_per_s = 0;
  double body_size_m = 0.1;   // longest edge or diameter
  double surface_size_m = 0;  // of another body that was hit; 0: a surface of the room
  MaterialId body_material = kUnknownMaterial;
  MaterialId surface_material = kUnknownMaterial;
};

struct SoundConfig {
  int impacts_max = 64;  // that can wait for one block
  int sounds_max_per_block = 8;
  int reflections_max = 6;      // of one sound, 0 .. 8; 0: as in the open air
  double room_range_m = 10;     // a wall farther away answers 60 ms late: an echo, not a reflection
  double gain = 1;              // of everything
  double audible_least = 1e-3;  // amplitude at the ear, of full scale, that is worth a voice: -60 dB
};

struct SoundCounts {
  std::uint64_t impacts = 0;    // that were handed in
  std::uint64_t sounds = 0;     // of them heard
  std::uint64_t inaudible = 0;  // of them too quiet to play
  std::uint64_t left_out = 0;   // of them for want of room in the list, the block or the mixer
  std::uint64_t reflections = 0;
  std::uint64_t reflections_left_out = 0;  // for want of voices
  std::uint64_t sample_frames = 0;
};

/// Sample frames of each block so that they add up to the time: a video frame of 33,333,333 ns has 1600; at
/// rates that do not divide 48 kHz the remainder goes on to the next block.
class BlockSizes {
 public:
  /// Step. `block` of at most a minute; negative counts as nothing.
  std::size_t next(rt::Duration block) noexcept;

 private:
  std::int64_t remainder_ = 0;  // sample frames * 1e9; between -half and half a sample frame
};

/// Thread-bound.
class SoundStage {
 public:
  static std::size_t bytes_needed(const SoundConfig& config);
  /// Boot. The table is copied; what `room` looks at outlives the stage.
  void bind(rt::Slice memory, const SoundConfig& config, const contact::MaterialTable& table,
            const contact::DistanceField& room);

  /// Takes an impact for the next block: ok | full (a quieter one made room, or this one was the quietest) |
  /// skipped (no energy, or numbers that are not finite). Step.
  rt::Status add(const Impact& impact) noexcept;

  /// Begins the sounds of the impacts that wait and mixes the next block into `stereo` (interleaved). A pose
  /// that is not finite leaves the listener where it was. ok | device_lost. Step, but see the head of this
  /// file: not under the heap guard.
  rt::Status step(const T_WorldDepth& T_world_listener, hal::SpatialMixer& mixer,
                  std::span<float> stereo) noexcept;

  [[nodiscard]] const SoundCounts& counts() const { return counts_; }

 private:
  struct Scored {
    double loudness = 0;
    std::uint32_t impact = 0;
    std::uint32_t seed = 0;
  };

  void begin_sound(const Scored& scored, int sounds_to_come, hal::SpatialMixer& mixer) noexcept;

  SoundConfig config_;
  contact::MaterialTable table_;
  contact::DistanceField room_;
  std::span<Impact> impacts_;
  std::span<Scored> scored_;
  std::span<float> clip_, reflected_;
  std::size_t impacts_count_ = 0;
  Vec3d listener_world_m_;
  std::uint32_t seed_ = 0;
  SoundCounts counts_;
};

}  // namespace tactus::sound
