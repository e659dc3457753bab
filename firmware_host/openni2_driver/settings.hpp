// What the environment asks of the driver.
//
//   TACTUS_OPENNI2_SOURCE  what the device tactus://0 plays: synthetic:NAME[?...], FILE.tac, or a folder in TUM RGB-D or
//                          7-Scenes layout; without it there is no such device when OpenNI2 starts. Read again at each opening.
//   TACTUS_OPENNI2_SPEED   how many times faster than its times; 1
//   TACTUS_OPENNI2_LOOP    0: it falls silent at its end; 1: it begins again, times and numbers going on. 1, as a device
//                          has no end
//   TACTUS_OPENNI2_UNPLUG  a file: while it exists, tactus://0 is unplugged
#pragma once

#include <string>

#include "hal/camera.hpp"
#include "rt/status.hpp"

namespace tactus::openni2_driver {

inline constexpr const char* kUriPrefix = "tactus://";

struct Settings {
  std::string source;  // empty: none
  double speed = 1;
  bool has_loop = true;
};
Settings read_settings();
std::string unplug_file();

/// A source by its name, decoded ahead. Error: the sentence of its backend.
rt::Result<hal::Sensor> open_source(const std::string& source);

}  // namespace tactus::openni2_driver
