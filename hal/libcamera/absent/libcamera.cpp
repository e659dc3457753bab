// Stands in where libcamera was not there at configure time: says so, opens nothing.
#include "hal/libcamera/libcamera.hpp"

namespace tactus::hal::libcamera {
namespace {
constexpr const char* kNotBuilt =
    "this program was built without libcamera; build it where libcamera-dev is installed, or take the camera through "
    "v4l2:/dev/videoN.";
}  // namespace

rt::Result<LiveCamera<ColorCamera>> open_color(const LibcameraRequest&) {
  return rt::Error{rt::ExitCode::device_unavailable, std::string("libcamera: ") + kNotBuilt};
}

DeviceList list_devices() { return {"libcamera", {}, std::string("Not built: ") + kNotBuilt}; }

}  // namespace tactus::hal::libcamera
