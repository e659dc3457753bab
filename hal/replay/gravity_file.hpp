// Which way is down, from the three kinds of file that know.
#pragma once

#include <optional>
#include <string_view>

#include "hal/transform.hpp"
#include "rt/status.hpp"
#include "rt/time.hpp"

namespace tactus::hal::replay {

/// Three numbers on one line or three (our gravity.txt, 7-Scenes' gravity-direction.txt), made unit length.
/// The frame they are in is the caller's knowledge:
///   gravity.txt            the depth frame of the recording's first frame
///   gravity-direction.txt  the world of the pose files (checked on a real kitchen: taken so, 17 % of all
///   surface
///                          normals are within 5 degrees of it and the nearest normal peak is 1.8 degrees
///                          away; taken as the first camera's, 8 % and 6.1 degrees)
rt::Result<Vec3d> parse_gravity(std::string_view text, std::string_view file);

/// Direction of gravity (unit) in the optical depth frame at `time`, from TUM's accelerometer.txt ("timestamp
/// ax ay az", m/s^2): the mean of the samples within 100 ms (of windows from 10 to 500 ms it had the least
/// error against motion capture: 4.2 degrees mean, 8 at the 95th percentile, in fast rotation). At rest an
/// accelerometer measures minus gravity; the Kinect's axes are the optical frame's turned by half a turn
/// about the optical axis (x left, y up, z forward), so gravity_depth = (ax, ay, -az) / |a|. Nothing when
/// fewer than 3 samples are near, or when their mean is not 5 to 15 m/s^2 (the camera was falling or being
/// shaken). Unreadable lines are passed over.
std::optional<Vec3d> gravity_from_accelerometer(std::string_view text, rt::SensorTime time);

}  // namespace tactus::hal::replay
