// What a synthetic recording is made of, and its name on the command line.
#pragma once

#include <cstdint>
#include <string_view>

#include "hal/calibration.hpp"
#include "hal/synthetic/scene.hpp"
#include "rt/status.hpp"

namespace tactus::hal::synthetic {

enum class Mode : std::uint8_t { vga_640x480, wide_960x540, qvga_320x240 };
enum class TrajectoryKind : std::uint8_t { handheld, still };

struct SyntheticOptions {
  SceneId scene = SceneId::bedroom;
  Mode mode = Mode::vga_640x480;
  int frames_count = 300;  // at 30 Hz
  bool has_noise = true;
  std::uint64_t seed = 1;
  TrajectoryKind trajectory = TrajectoryKind::handheld;
  bool is_registered = true;             // false: colour comes from a second camera beside, with distortion
  int blank_first = 0, blank_count = 0;  // these frames are all zero
  bool has_jump = false;  // after the blank frames the camera stands 13 cm and 6.5 degrees off its path
};

inline constexpr double kFrameRate_hz = 30;
inline constexpr double kDepth_m_per_unit = 0.0002;  // 1/5000 m, as in the TUM recordings
inline constexpr double kJump_m = 0.13;
inline constexpr double kJump_degrees = 6.5;

/// Reads `synthetic:SCENE[?key=value[&key=value]...]`, SCENE bedroom | office | wall | corner, keys:
///   frames=N (1..100000)   mode=640x480|960x540|320x240 (optionally @30)   trajectory=handheld|still seed=N
///   noise=0|1   registered=0|1   blank=FIRST:COUNT   jump=0|1 (needs blank)
/// The prefix may be missing. Pure; the error names the word that is wrong and what is allowed. Boot.
rt::Result<SyntheticOptions> parse_synthetic_name(std::string_view name);

/// The rig of a mode. Depth: 525 px focal length at 640x480 with the principal point in the image's middle
/// (319.5, 239.5; pixel centres are at integers), scaled so that pixel areas keep their edges: c' = (c + 0.5)
/// s - 0.5. 960x540 is 640x480 scaled by 1.5 with 90 rows cut off above and below. Unregistered: the colour
/// camera sits 35 mm to the right, turned by 0.6 degrees, with its own intrinsics and Brown distortion.
RigCalibration calibration_of(const SyntheticOptions& options);

}  // namespace tactus::hal::synthetic
