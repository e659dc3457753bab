#include "firmware_host/devices.hpp"

#include <nlohmann/json.hpp>

#include "firmware_host/open_live.hpp"
#include "firmware_host/summary.hpp"

namespace tactus::firmware {

std::string devices_text(std::span<const hal::DeviceList> lists) {
  std::string text;
  for (const hal::DeviceList& list : lists) {
    text += list.backend + "\n";
    if (list.devices.empty()) text += "  none: " + list.why_none + "\n";
    for (const hal::DeviceEntry& device : list.devices) {
      text += "  " + device.source + "  " + device.name + "\n";
      for (const std::string& format : device.formats) text += "    " + format + "\n";
      if (!device.trouble.empty()) text += "    cannot be used: " + device.trouble + "\n";
    }
  }
  return text;
}

std::string devices_json(std::span<const hal::DeviceList> lists) {
  nlohmann::json all = nlohmann::json::array();
  for (const hal::DeviceList& list : lists) {
    nlohmann::json devices = nlohmann::json::array();
    for (const hal::DeviceEntry& device : list.devices)
      devices.push_back({{"source", device.source},
                         {"name", device.name},
                         {"formats", device.formats},
                         {"trouble", device.trouble}});
    all.push_back({{"backend", list.backend}, {"devices", devices}, {"why_none", list.why_none}});
  }
  return to_text(all);
}

rt::Result<std::string> devices(const DevicesOptions& options) {
  const std::vector<hal::DeviceList> lists = list_all_devices();
  return options.is_json ? devices_json(lists) : devices_text(lists);
}

}  // namespace tactus::firmware
