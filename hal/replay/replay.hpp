// The replay backend: a folder of image files as a sensor.
//
// TUM RGB-D layout (paths in the lists are relative to the folder; '#' starts a comment line):
//   depth.txt          "timestamp path" per frame; 16-bit greyscale PNG; 0 and 65535 are no measurement
//   rgb.txt            the same for colour, 8-bit PNG or JPEG; absent: depth only
//   intrinsics.txt     "fx fy cx cy width height depth_scale" (units per metre); colour is taken as
//   registered.
//                      Absent, with no calibration.toml: TUM's own default, 525 525 319.5 239.5 640 480 5000
//   groundtruth.txt    "timestamp tx ty tz qx qy qz qw", camera to world, metres: Sensor::truth
//   label.txt          "timestamp path", 8-bit greyscale PNG of material ids, at the times of depth.txt:
//   Sensor::labels gravity.txt        our own: "gx gy gz", direction of gravity in the depth frame of the
//   first frame listed accelerometer.txt  "timestamp ax ay az" of a Kinect: gravity when there is no
//   gravity.txt
// 7-Scenes layout:
//   frame-NNNNNN.depth.png  millimetres, 0 and 65535 invalid; .color.{png,jpg,jpeg}; .pose.txt, a 4x4
//   camera-to-world
//                           matrix; .label.png (our own). Times are frame number / 30 Hz.
//   camera-intrinsics.txt   3x3 matrix of the depth camera; absent: 585 585 320 240 for 640x480
//   calibration.txt         both cameras, see parse_calibration_text; absent: colour is taken as registered,
//   and a note
//                           says that it probably is not
//   gravity-direction.txt   direction of gravity in the world of the pose files; or gravity.txt as above
// In both, calibration.toml (see parse_calibration_toml) says all of it and wins.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>

#include "hal/camera.hpp"
#include "rt/status.hpp"

namespace tactus::hal {

struct ReplayOptions {
  /// Frames [first, last) of the depth list (7-Scenes: of the frame numbers) are played, as in --frames A:B,
  /// with the colour frames within 20 ms of them.
  std::uint64_t first = 0;
  std::uint64_t last = std::numeric_limits<std::uint64_t>::max();
  /// Frames that a thread per camera decodes ahead; then read() makes no heap call. 0: read() decodes itself.
  std::size_t prefetch = 0;
};

/// Opens a recording. What the session cannot do without (depth, calibration, sizes) is checked here; single
/// bad frames are rejected and counted by read(), and other oddities become Sensor::notes. Sequence numbers
/// are places in the list (7-Scenes: frame numbers), so a rejected frame leaves a gap. Errors, exit code 3:
/// one sentence naming the file, the line and what is wrong; 2: the range holds no frame. Boot phase; any
/// thread.
rt::Result<Sensor> open_replay(const std::filesystem::path& directory, const ReplayOptions& options);

/// Whether the folder looks like one of the two layouts; reads no file.
bool is_recording(const std::filesystem::path& directory);

}  // namespace tactus::hal
