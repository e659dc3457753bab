#include "firmware_host/first_pose.hpp"

#include <cmath>
#include <cstdio>

namespace tactus::firmware {

T_WorldDepth level_pose(const Vec3d& gravity_depth) {
  const Vec3d up = -gravity_depth.normalized();
  // Rows of R_world_depth are the world's axes in the camera: y up, z away from where the camera looks.
  Vec3d back = Vec3d{0, 0, -1} - up * (Vec3d{0, 0, -1}.dot(up));
  if (back.norm() < 0.1) back = Vec3d{0, 1, 0} - up * (Vec3d{0, 1, 0}.dot(up));  // looks straight up or down
  back = back.normalized();
  const Vec3d right = up.cross(back);
  return {{{right.x, right.y, right.z, up.x, up.y, up.z, back.x, back.y, back.z}}, {}};
}

std::optional<Vec3d> parse_direction(const std::string& text) {
  Vec3d v;
  char end = 0;
  if (std::sscanf(text.c_str(), "%lf,%lf,%lf%c", &v.x, &v.y, &v.z, &end) != 3) return std::nullopt;
  if (!(v.norm() > 1e-6) || !std::isfinite(v.norm())) return std::nullopt;
  return v;
}

rt::Result<Gravity> find_gravity(const std::string& gravity, const hal::Sensor& sensor) {
  if (!gravity.empty()) {
    const auto direction = parse_direction(gravity);
    if (!direction)
      return rt::Error{rt::ExitCode::bad_usage, "--gravity " + gravity + ": it reads x,y,z, not all zero."};
    return Gravity{direction->normalized(), "command line"};
  }
  if (sensor.gravity_depth) return Gravity{*sensor.gravity_depth, "recording"};
  return Gravity{{0, 1, 0}, "none: the camera is taken as level"};
}

rt::Result<void> check_depth_size(const std::string& source, const hal::Sensor& sensor) {
  if (sensor.calibration.depth.width % 4 != 0 || sensor.calibration.depth.height % 4 != 0 ||
      sensor.calibration.depth.width < 128 || sensor.calibration.depth.width > 960 ||
      sensor.calibration.depth.height < 96 || sensor.calibration.depth.height > 640)
    return rt::Error{rt::ExitCode::bad_input, source + ": depth images of " +
                                                  std::to_string(sensor.calibration.depth.width) + "x" +
                                                  std::to_string(sensor.calibration.depth.height) +
                                                  " are not supported: both sides must be multiples of 4, "
                                                  "the width 128 to 960, the height 96 to 640."};
  return {};
}

}  // namespace tactus::firmware
