// Where the first frame's camera is taken to be, and what a sensor must offer to be used at all.
#pragma once

#include <optional>
#include <string>

#include "hal/camera.hpp"
#include "rt/status.hpp"

namespace tactus::firmware {

struct Gravity {
  Vec3d direction_depth{0, 1, 0};  // unit, in the first depth frame
  std::string origin;              // for people
};

/// From the command line ("x,y,z", may be empty), else from the source, else the camera is taken as level.
/// bad_usage for a text that is no direction. Boot.
rt::Result<Gravity> find_gravity(const std::string& gravity, const hal::Sensor& sensor);

/// First pose of the depth camera: gravity along -y, heading kept, origin at the camera. Pure.
T_WorldDepth level_pose(const Vec3d& gravity_depth);

/// bad_input when the depth images have a size that the stages cannot work on. Pure.
rt::Result<void> check_depth_size(const std::string& source, const hal::Sensor& sensor);

/// "x,y,z": three numbers that are not all zero. Boot.
std::optional<Vec3d> parse_direction(const std::string& text);

}  // namespace tactus::firmware
