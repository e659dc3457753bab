// What `tactus devices` shows of a backend: each has a function that answers this.
#pragma once

#include <string>
#include <vector>

namespace tactus::hal {

struct DeviceEntry {
  std::string source;                // what to write as SOURCE, or as ?color=
  std::string name;                  // of the device, in its driver's words
  std::vector<std::string> formats;  // "depth Z16 640x480 30 Hz", one line each
  std::string trouble;               // one sentence: why it cannot be opened; empty when it can
};

struct DeviceList {
  std::string backend;               // "OpenNI2", "V4L2", "libcamera"
  std::vector<DeviceEntry> devices;
  std::string why_none;              // one sentence when there is none: not built, no permission, no driver, none plugged in
};

}  // namespace tactus::hal
