// What a device may use: the built-in profiles side by side. A TOML file or --set key=value changes
// single values (firmware_host/profile_file.hpp).
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

#include "hal/live_camera.hpp"
#include "pipeline/contact/world.hpp"
#include "pipeline/interact/game.hpp"
#include "pipeline/map/refine_labels.hpp"
#include "pipeline/segment/keyframe_policy.hpp"
#include "pipeline/spine.hpp"
#include "rt/time.hpp"

namespace tactus {

struct Profile {
  std::string_view name = "x86";
  SpineConfig spine;
  std::size_t bodies_capacity = 128;  // a plate breaks into 12, a bullet tears out up to 12 chips
  segment::KeyframeRules keyframes;
  bool refines_labels = true;                                      // by the 3D CRF
  map::RefineConfig refine = map::RefineConfig::for_cells(19456);  // fewer where memory_bytes_max leaves less
  int threads_count = 1;                              // of the spine's fork-join; results do not depend on it
  std::size_t network_bytes = std::size_t{48} << 20;  // taken only when a network is loaded
  std::size_t trace_records_count = 6144;  // per thread, 40 bytes each: the last 40 s of a 30 Hz session
  std::size_t memory_bytes_max = std::size_t{96} << 20;  // of the plan, without the network
  hal::ModeRequest sensor_mode;   // asked of a live sensor whose source names none; 0: its own choice
  bool needs_registered = false;  // a live sensor with colour of its own delivers depth in it, or is refused
};

/// A desktop or laptop with recorded sensor dumps.
constexpr Profile x86_profile() { return {}; }

/// A headset: 8192 blocks are about 25 square metres of surface at 1 cm.
constexpr Profile headset_profile() {
  Profile p;
  p.name = "headset";
  p.spine.map.blocks_capacity = 8192;
  p.spine.relocalizer.keyframes_capacity = 32;
  p.bodies_capacity = 64;
  p.refine = map::RefineConfig::for_cells(8192);
  p.trace_records_count = 4096;
  p.memory_bytes_max = std::size_t{64} << 20;
  return p;
}

/// The paper's sensor mode, 960x540 at 30 Hz with registered depth: 107.1 MiB with the CRF's whole region (`tactus plan`).
constexpr Profile paper_profile() {
  Profile p;
  p.name = "paper";
  p.sensor_mode = {960, 540, 30};
  p.needs_registered = true;
  p.memory_bytes_max = std::size_t{108} << 20;
  return p;
}

constexpr contact::WorldConfig world_config(const Profile& profile) {
  contact::WorldConfig config;
  config.bodies_capacity = profile.bodies_capacity;
  config.contacts_capacity = 3 * profile.bodies_capacity;  // most are chips and shards, which lie on three points
  return config;
}

constexpr interact::GameConfig game_config(const Profile& profile) {
  interact::GameConfig config;
  config.bodies_capacity = profile.bodies_capacity;
  return config;
}

}  // namespace tactus
