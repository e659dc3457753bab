// What every camera backend must do, whatever is behind it: instantiate CameraConformance with ways to open a
// sensor.
//
//   INSTANTIATE_TEST_SUITE_P(Replay, CameraConformance, testing::Values(CameraCase{...}), case_name);
//
// A case opens a sensor of finite length that gives the same session every time it is opened: a recording, a
// simulator, a device behind a recorder.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <functional>
#include <ostream>
#include <string>

#include "hal/camera.hpp"

namespace tactus::hal::conformance {

struct CameraCase {
  std::string name;
  std::function<rt::Result<Sensor>()> open;
  std::uint64_t depth_frames = 0;    // delivered
  std::uint64_t color_frames = 0;    // delivered; 0: no colour camera
  std::uint64_t depth_rejected = 0;  // frames_rejected + timestamps_rejected
  std::uint64_t color_rejected = 0;
  bool loses_after_tap = false;  // frames that a tap has seen may get lost on the way to the reader
};

inline void PrintTo(const CameraCase& c, std::ostream* out) { *out << c.name; }
inline std::string case_name(const testing::TestParamInfo<CameraCase>& info) { return info.param.name; }

/// Its tests are in camera_suite.cpp.
class CameraConformance : public testing::TestWithParam<CameraCase> {
 protected:
  /// Ends the test program when the sensor does not open: nothing else could be said.
  static Sensor open();
};

}  // namespace tactus::hal::conformance
