// A rig's calibration from all that OpenNI2 tells of it: sizes and fields of view.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hal/calibration.hpp"

namespace tactus::hal::openni2 {

struct SeenFrom {
  int width = 0, height = 0;               // pixels
  double fov_x_rad = 0, fov_y_rad = 0;     // 0: not told
};

/// Fills all of `rig` but the depth unit: focal lengths from the fields of view, principal points in the middle, no
/// distortion; `can_be_registered` becomes registered where both sizes agree. Says in `notes` what was assumed.
void assume_calibration(const SeenFrom& depth, const std::optional<SeenFrom>& color, bool can_be_registered,
                        const std::string& source, RigCalibration& rig, std::vector<std::string>& notes);

}  // namespace tactus::hal::openni2
