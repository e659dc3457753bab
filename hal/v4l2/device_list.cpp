#include <algorithm>
#include <cstring>
#include <filesystem>

#include "hal/v4l2/node.hpp"
#include "hal/v4l2/v4l2.hpp"

namespace tactus::hal::v4l2 {
namespace {

/// The nodes' paths in the order of their numbers.
std::vector<std::string> node_paths() {
  std::vector<std::string> paths;
  std::error_code error;
  for (std::filesystem::directory_iterator it("/dev", error), end; !error && it != end; it.increment(error)) {
    const std::string name = it->path().filename().string();
    constexpr std::string_view kPrefix = "video";
    if (name.size() > kPrefix.size() && name.starts_with(kPrefix) &&
        name.find_first_not_of("0123456789", kPrefix.size()) == std::string::npos)
      paths.push_back(it->path().string());
  }
  std::sort(paths.begin(), paths.end(), [](const std::string& a, const std::string& b) {
    return a.size() != b.size() ? a.size() < b.size() : a < b;
  });
  return paths;
}

/// False: not a camera.
bool look_at(const std::string& path, DeviceEntry& entry) {
  entry.source = "v4l2:" + path;
  entry.name = path;
  int error = 0;
  const Descriptor node = open_node(path.c_str(), error);
  if (!node.is_open()) {
    entry.trouble = open_trouble(path, error);
    return true;
  }
  NodeInfo info;
  if (error = read_info(node.get(), info); error != 0) {
    entry.trouble = path + " does not answer as a V4L2 device: " + std::strerror(error);
    return true;
  }
  if (!info.is_capture()) return false;
  entry.name = std::string(info.card.data()) + " (" + info.driver.data() + ", " + info.bus_info.data() + ")";
  entry.formats = mode_lines(enumerate_offers(node.get(), info.is_multiplanar(), {}));
  return true;
}

}  // namespace

DeviceList list_devices() {
  DeviceList list;
  list.backend = "V4L2";
  const std::vector<std::string> paths = node_paths();
  for (const std::string& path : paths) {
    DeviceEntry entry;
    if (look_at(path, entry)) list.devices.push_back(std::move(entry));
  }
  if (!list.devices.empty()) return list;
  list.why_none = paths.empty()
                      ? "there is no /dev/video node: no camera is plugged in, or its driver is not loaded (dmesg tells)"
                      : "none of the " + std::to_string(paths.size()) +
                            " /dev/video nodes captures images; they are for metadata, output or codecs";
  return list;
}

}  // namespace tactus::hal::v4l2
