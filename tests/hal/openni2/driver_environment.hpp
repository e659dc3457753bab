// What our driver plays in these tests: set before OpenNI2 starts, which it does once in a process.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>

#include "tests/support/temporary_folder.hpp"

namespace tactus::hal::openni2 {

inline constexpr const char* kSource = "synthetic:corner?frames=12&mode=320x240";

inline const std::filesystem::path& unplug_file() {
  static const test::TemporaryFolder folder;
  static const std::filesystem::path path = folder.path() / "unplug";
  return path;
}

/// Before a device is opened: the driver looks at the first two when it starts, and at all when a device is opened.
inline void set_driver(const std::string& source, const char* speed, bool has_loop) {
  setenv("TACTUS_OPENNI2_SOURCE", source.c_str(), 1);
  setenv("TACTUS_OPENNI2_UNPLUG", unplug_file().c_str(), 1);
  setenv("TACTUS_OPENNI2_SPEED", speed, 1);
  setenv("TACTUS_OPENNI2_LOOP", has_loop ? "1" : "0", 1);
}

}  // namespace tactus::hal::openni2
