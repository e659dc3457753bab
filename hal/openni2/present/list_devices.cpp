#include "hal/openni2/openni2.hpp"
#include "hal/openni2/present/library.hpp"
#include "hal/openni2/present/modes.hpp"

namespace tactus::hal::openni2 {
namespace {

DeviceEntry ask(const OniDeviceInfo& info) {
  DeviceEntry entry{std::string("openni2:") + info.uri, std::string(info.vendor) + " " + info.name, {}, {}};
  OniDeviceHandle device = nullptr;
  if (oniDeviceOpen(info.uri, &device) != ONI_STATUS_OK) {
    const std::string words = last_words();
    entry.trouble = "it cannot be opened: in use, or not allowed to this user" + (words.empty() ? "" : " (" + words + ")");
    return entry;
  }
  for (const OniSensorType sensor : {ONI_SENSOR_DEPTH, ONI_SENSOR_COLOR}) {
    const OniSensorInfo* modes = oniDeviceGetSensorInfo(device, sensor);
    if (modes == nullptr) continue;
    for (int i = 0; i < modes->numSupportedVideoModes; ++i)
      if (format_of(modes->pSupportedVideoModes[i].pixelFormat))
        entry.formats.push_back(to_string(modes->pSupportedVideoModes[i]));
  }
  (void)oniDeviceClose(device);
  return entry;
}

}  // namespace

DeviceList list_devices() {
  DeviceList list{"OpenNI2", {}, {}};
  auto library = Library::get();
  if (!library) {
    list.why_none = library.error().message;
    return list;
  }
  (*library)->call([&] {
    for (const OniDeviceInfo& info : (*library)->devices()) list.devices.push_back(ask(info));
  });
  if (list.devices.empty())
    list.why_none = "no device is plugged in that one of OpenNI2's drivers knows, or this user may not use it.";
  return list;
}

}  // namespace tactus::hal::openni2
