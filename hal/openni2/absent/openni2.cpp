// Stands in where OpenNI2 was not there at configure time.
#include "hal/openni2/openni2.hpp"

namespace tactus::hal::openni2 {
namespace {

rt::Error absent(const std::string& what) {
  return {rt::ExitCode::device_unavailable,
          what + ": this program was built without OpenNI2; install libopenni2-dev and build it again."};
}

}  // namespace

rt::Result<Sensor> open_openni2(const OpenNi2Request& request) {
  return absent(request.uri.empty() ? "openni2" : "openni2:" + request.uri);
}

rt::Result<Sensor> open_oni(const std::filesystem::path& file, const OniOptions&) { return absent(file.string()); }

DeviceList list_devices() { return {"OpenNI2", {}, absent("OpenNI2").message}; }

}  // namespace tactus::hal::openni2
