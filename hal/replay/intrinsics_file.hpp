// The calibration files: TUM-layout intrinsics.txt, 7-Scenes camera-intrinsics.txt and calibration.txt, our
// calibration.toml.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "hal/calibration.hpp"
#include "rt/status.hpp"

namespace tactus::hal::replay {

/// Larger images than this are refused before a byte is allocated for them.
inline constexpr int kImageSideMax = 8192;
inline constexpr long kImagePixelsMax = 16L * 1024 * 1024;

/// Empty when the values can be those of a camera, else what is wrong: sizes in 1..8192 and 16 Mpixel
/// together, focal lengths 1..1e5, centre within one image size of the image, distortion coefficients finite
/// and below 100.
std::string fault_of(const Intrinsics& intrinsics);

/// "fx fy cx cy width height depth_scale" (units per metre), one line besides '#' comments. The camera is
/// taken as registered: colour, when there is any, shares it.
rt::Result<RigCalibration> parse_intrinsics(std::string_view text, std::string_view file);

/// The 3x3 pinhole matrix of camera-intrinsics.txt; sizes are not in it and stay 0.
rt::Result<Intrinsics> parse_camera_matrix(std::string_view text, std::string_view file);

/// calibration.txt beside 7-Scenes frames:
///   depth fx fy cx cy width height
///   color fx fy cx cy width height [tx TX] [ty TY] [tz TZ]
/// Both pinholes with parallel axes: a point (X, Y, Z) of the depth camera lies at (X + TX, Y + TY, Z + TZ),
/// metres, in the colour camera's frame. Not registered. Without a colour line there is no colour
/// calibration.
rt::Result<RigCalibration> parse_calibration_text(std::string_view text, std::string_view file);

/// Our calibration.toml, which can say everything a RigCalibration can:
///   format = 1
///   registered = false
///   [depth]                       # or [color], same keys without m_per_unit
///   width = 640
///   height = 480
///   fx = 585.0
///   fy = 585.0
///   cx = 320.0
///   cy = 240.0
///   distortion = [k1, k2, p1, p2, k3]   # OpenCV's order; absent: none
///   m_per_unit = 0.001
///   [color.from_depth]            # p_color = rotation * p_depth + translation_m; absent: the same pose
///   rotation = [1, 0, 0, 0, 1, 0, 0, 0, 1]   # row-major
///   translation_m = [-0.025, 0.0, 0.0]
/// Unknown keys are errors (a misspelt key must not be a silent default). With registered = true there is no
/// [color].
rt::Result<RigCalibration> parse_calibration_toml(std::string_view text, std::string_view file);

/// The inverse of parse_intrinsics / parse_calibration_toml; every number reads back to the same bits.
std::string format_intrinsics(const RigCalibration& calibration);
std::string format_calibration_toml(const RigCalibration& calibration);

}  // namespace tactus::hal::replay
