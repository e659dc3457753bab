// What is known of a camera rig: intrinsics with distortion, poses between the cameras, units of the raw values.
#pragma once

#include "hal/transform.hpp"

namespace tactus::hal {

/// Pinhole camera with Brown-Conrady distortion (OpenCV's k1 k2 p1 p2 k3). Pixel centres are at integer coordinates:
/// u = fx x' + cx with x' the distorted normalised coordinate. Zero coefficients mean an ideal pinhole.
struct Intrinsics {
  int width = 0, height = 0;  // pixels
  double fx = 0, fy = 0, cx = 0, cy = 0;
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0;

  [[nodiscard]] bool has_distortion() const { return k1 != 0 || k2 != 0 || p1 != 0 || p2 != 0 || k3 != 0; }
  friend bool operator==(const Intrinsics&, const Intrinsics&) = default;
};

/// One depth camera and, when has_color, one colour camera. `registered` means that the device delivers depth already
/// resampled into the colour camera: both share intrinsics and pose, and the register stage copies.
struct RigCalibration {
  Intrinsics depth;
  double depth_m_per_unit = 0.001;  // metres per raw depth unit
  bool has_color = false;
  bool registered = false;
  Intrinsics color;
  T_ColorDepth T_color_depth;  // maps a point of the depth camera into the colour camera
};

}  // namespace tactus::hal
