// How the real room answers a sound: a reflection from each large surface, duller by what it is made of.
//
// Image sources of the first order (Allen, Berkley 1979, "Image method for efficiently simulating small-room
// acoustics"). The planes come from the labelled map: 26 rays from the source and as many from the listener,
// each with three beside it where it hits no plane found before. A reflection is kept when rays from source
// and listener both reach its point on the surface, or one does and the other ends on something that sound
// bends round. Where the map is empty there is no answer: what was never seen reflects nothing.
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "hal/transform.hpp"
#include "pipeline/contact/distance_field.hpp"
#include "pipeline/contact/materials.hpp"

namespace tactus::sound {

inline constexpr double kSoundSpeedMPerS = 343;  // dry air at 20 degrees
inline constexpr int kBands = 3;                 // around 250, 1000 and 4000 Hz, as the table's absorption

struct Reflection {
  Vec3d image_world_m;              // the source, mirrored: where the sound seems to come from
  Vec3d point_world_m;              // on the surface
  double path_m = 0;                // from the source by the point to the listener: |image - listener|
  std::array<double, kBands> gain;  // of the amplitude: sqrt(1 - expected absorption), less round an obstacle
};

/// Places of a sound and of its hearer. The source may lie on a surface: rays start 8 cm in front of it,
/// along source_normal_world or, where that is zero, towards the listener. A surface nearer than 15 cm gives
/// no reflection: it would come less than a millisecond later and only colour the sound.
struct SoundPath {
  Vec3d source_world_m;
  Vec3d source_normal_world;
  Vec3d listener_world_m;
};

/// The shortest out.size() reflections, shortest first, and how many there are. About 90 rays of 1 to 3 us in
/// an empty room, at most 500, each of at most range_m. Step.
int find_reflections(const contact::DistanceField& room, const contact::MaterialTable& table, const SoundPath& path,
                     double range_m, std::span<Reflection> out) noexcept;

/// Writes `clip` with its three bands scaled by `gain` to `out` (of the same size), split at 500 and 2000 Hz
/// by one-pole filters that add up to the clip when all gains are 1. Neighbouring bands leak: one pole falls
/// by 6 dB an octave.
void apply_bands(const std::array<double, kBands>& gain, std::span<const float> clip,
                 std::span<float> out) noexcept;

}  // namespace tactus::sound
