// The throws of `study plausibility`, and how each is judged.
//
// A room is played in lockstep once under each condition with one script: plates and glasses, aimed at pixels
// spread over the picture and over the session while the camera moves. Aim, camera path and map do not depend
// on the condition, so the throws leave alike, and under `uniform` and `semantic`, which have the same
// surfaces, they fly and arrive alike: what the first impact meets is one contact in all three. It is
//   - the first impact on a real surface that the game logged, where a true surface is within kSurface_m of
//   it and the
//     thing's middle has not flown on kPast_m beyond where it first crosses a true surface;
//   - else, when it has, or when there was no impact: that crossing. The map did not have the surface:
//   `through`;
//   - else, stopped where nothing is: that place, and what is expected there is `through`.
// What is expected is contact::judge_impact for the true material of the place, with certainty, at the energy
// of the impact (of the crossing: of the speed along the surface's normal). Under `none` nothing ever stops:
// `through` at the same contact. Left out of every condition, and counted: throws that met another virtual
// thing first, that were still in the air when the session ended, that met nothing at all, and that left or
// arrived differently.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "firmware_host/followed_order.hpp"
#include "firmware_host/true_room.hpp"
#include "hal/calibration.hpp"
#include "pipeline/interact/game.hpp"
#include "pipeline/interact/script.hpp"

namespace tactus::firmware {

inline constexpr double kSurface_m = 0.03;  // three voxels; a tracked room is off by a few millimetres
inline constexpr double kPast_m = 0.15;     // a plate's radius and some
inline constexpr std::uint64_t kTailFrames =
    40;  // without throws at a session's end, so that all arrive: 1.3 s

/// `throws_count` throws spread over the frames from the first second on, two plates to each glass, at 3 to 6
/// m/s. The same for the same arguments everywhere. Pure; allocates.
interact::Script plausibility_script(int throws_count, std::uint64_t frames_count,
                                     const hal::Intrinsics& picture, std::uint64_t seed);

/// By ThingKind.
using ThingBuilds = std::array<ThingBuild, interact::kThingsCount>;

/// What one condition's session left behind; the log outlives it.
struct ThrowLog {
  std::span<const interact::GameEvent> events;
  rt::SensorTime end;  // of the last frame
};

enum class ThrowKind : std::uint8_t { impact, missing_surface, nothing_there };
inline constexpr std::array<std::string_view, 3> kThrowKindNames = {"impact", "missing surface",
                                                                    "nothing there"};

/// One throw in all conditions.
struct JudgedThrow {
  std::size_t index = 0;  // in the script
  ThrowKind kind = ThrowKind::impact;
  MaterialId true_material = kUnknownMaterial;
  MaterialId label = kUnknownMaterial;  // most likely one that `semantic` acted by
  float probability = 0;
  Vec3d position_world_m;
  double energy_j = 0;
  double surface_distance_m = 0;  // from the true surface, of an impact
  contact::Outcome expected = contact::Outcome::through;
  contact::Outcome uniform = contact::Outcome::through, semantic = contact::Outcome::through;
};

struct JudgedThrows {
  std::vector<JudgedThrow> judged;
  std::size_t thrown_count = 0;
  std::size_t met_body = 0, in_the_air = 0, met_nothing = 0, differed = 0;  // left out
};

/// What the room knows of itself decides what was to be expected. Pure; allocates.
JudgedThrows judge_throws(const TrueRoom& room, const interact::Script& script, const ThingBuilds& things,
                          const contact::MaterialTable& table, const ThrowLog& none, const ThrowLog& uniform,
                          const ThrowLog& semantic);

}  // namespace tactus::firmware
