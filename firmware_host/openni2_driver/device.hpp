// A source as an OpenNI2 device.
#pragma once

#include <array>

#include "firmware_host/openni2_driver/openni2_api.hpp"
#include "firmware_host/openni2_driver/source_player.hpp"

namespace tactus::openni2_driver {

class Device final : public oni::driver::DeviceBase {
 public:
  Device(hal::Sensor sensor, Settings settings);

  OniStatus getSensorInfoList(OniSensorInfo** infos, int* count) override;
  oni::driver::StreamBase* createStream(OniSensorType type) override;
  void destroyStream(oni::driver::StreamBase* stream) override;
  OniBool isPropertySupported(int property) override;
  OniStatus getProperty(int property, void* data, int* bytes) override;
  OniStatus setProperty(int property, const void* data, int bytes) override;
  OniBool isImageRegistrationModeSupported(OniImageRegistrationMode mode) override;

  void unplug() { player_.unplug(); }

 private:
  [[nodiscard]] OniImageRegistrationMode registration() const;

  SourcePlayer player_;
  std::array<OniVideoMode, 2> modes_{};
  std::array<OniSensorInfo, 2> infos_{};
};

}  // namespace tactus::openni2_driver
