#include "hal/openni2/present/assumed_calibration.hpp"

#include <cmath>

namespace tactus::hal::openni2 {
namespace {

// PrimeSense's cameras (Kinect v1, Xtion, Carmine): what their driver says where it says anything.
constexpr double kUsualFovX_rad = 1.0144686, kUsualFovY_rad = 0.78980905;

bool is_possible(double fov_rad) { return fov_rad > 0.01 && fov_rad < 3.1; }

Intrinsics pinhole(const SeenFrom& seen) {
  return {.width = seen.width,
          .height = seen.height,
          .fx = seen.width / (2 * std::tan(seen.fov_x_rad / 2)),
          .fy = seen.height / (2 * std::tan(seen.fov_y_rad / 2)),
          .cx = (seen.width - 1) / 2.0,
          .cy = (seen.height - 1) / 2.0};
}

}  // namespace

void assume_calibration(const SeenFrom& depth_told, const std::optional<SeenFrom>& color_told, bool can_be_registered,
                        const std::string& source, RigCalibration& rig, std::vector<std::string>& notes) {
  SeenFrom depth = depth_told;
  const auto tells = [](const SeenFrom& seen) { return is_possible(seen.fov_x_rad) && is_possible(seen.fov_y_rad); };
  const bool color_tells = color_told && tells(*color_told);
  if (!tells(depth)) {
    depth.fov_x_rad = color_tells ? color_told->fov_x_rad : kUsualFovX_rad;
    depth.fov_y_rad = color_tells ? color_told->fov_y_rad : kUsualFovY_rad;
    notes.push_back(source + ": no field of view is told; a Kinect's is assumed, so sizes in the room may be wrong");
  }
  rig.has_color = color_told.has_value();
  rig.registered =
      rig.has_color && can_be_registered && color_told->width == depth.width && color_told->height == depth.height;
  SeenFrom color = color_told.value_or(SeenFrom{});
  if (rig.has_color && !color_tells) {
    color.fov_x_rad = depth.fov_x_rad;
    color.fov_y_rad = depth.fov_y_rad;
  }
  // Depth that was registered is seen from where colour is.
  rig.depth = pinhole(rig.registered ? color : depth);
  if (rig.has_color) rig.color = rig.registered ? rig.depth : pinhole(color);
  notes.push_back(source +
                  ": the calibration is assumed from the field of view; a calibration of this very camera is better");
  if (rig.has_color && !rig.registered)
    notes.push_back(source + ": depth and colour are not registered, and the distance between the two cameras is not told; "
                             "none is assumed, so colours lie a few pixels beside their surfaces");
}

}  // namespace tactus::hal::openni2
