#include "firmware_host/openni2_driver/device.hpp"

#include <cstring>

#include "firmware_host/openni2_driver/stream.hpp"

namespace tactus::openni2_driver {

Device::Device(hal::Sensor sensor, Settings settings) : player_(std::move(sensor), std::move(settings)) {
  modes_ = {Stream::mode_of(player_.sensor(), hal::Stream::depth), Stream::mode_of(player_.sensor(), hal::Stream::color)};
  infos_ = {OniSensorInfo{ONI_SENSOR_DEPTH, 1, modes_.data()}, OniSensorInfo{ONI_SENSOR_COLOR, 1, &modes_[1]}};
}

OniStatus Device::getSensorInfoList(OniSensorInfo** infos, int* count) {
  *infos = infos_.data();
  *count = player_.sensor().color ? 2 : 1;
  return ONI_STATUS_OK;
}

oni::driver::StreamBase* Device::createStream(OniSensorType type) {
  if (type == ONI_SENSOR_DEPTH) return new Stream(player_, hal::Stream::depth);
  if (type == ONI_SENSOR_COLOR && player_.sensor().color) return new Stream(player_, hal::Stream::color);
  return nullptr;
}

void Device::destroyStream(oni::driver::StreamBase* stream) { delete stream; }

OniImageRegistrationMode Device::registration() const {
  return player_.sensor().calibration.registered ? ONI_IMAGE_REGISTRATION_DEPTH_TO_COLOR : ONI_IMAGE_REGISTRATION_OFF;
}

OniBool Device::isPropertySupported(int property) {
  return property == ONI_DEVICE_PROPERTY_IMAGE_REGISTRATION || property == ONI_DEVICE_PROPERTY_DRIVER_VERSION ? TRUE : FALSE;
}

OniStatus Device::getProperty(int property, void* data, int* bytes) {
  if (property == ONI_DEVICE_PROPERTY_IMAGE_REGISTRATION) {
    const OniImageRegistrationMode mode = registration();
    if (*bytes < static_cast<int>(sizeof mode)) return ONI_STATUS_BAD_PARAMETER;
    std::memcpy(data, &mode, sizeof mode);
    *bytes = sizeof mode;
    return ONI_STATUS_OK;
  }
  if (property == ONI_DEVICE_PROPERTY_DRIVER_VERSION && *bytes >= static_cast<int>(sizeof(OniVersion))) {
    const OniVersion version{0, 1, 0, 0};
    std::memcpy(data, &version, sizeof version);
    *bytes = sizeof version;
    return ONI_STATUS_OK;
  }
  return ONI_STATUS_NOT_SUPPORTED;
}

OniStatus Device::setProperty(int property, const void* data, int bytes) {
  if (property != ONI_DEVICE_PROPERTY_IMAGE_REGISTRATION || bytes != static_cast<int>(sizeof(OniImageRegistrationMode)))
    return ONI_STATUS_NOT_SUPPORTED;
  OniImageRegistrationMode mode{};
  std::memcpy(&mode, data, sizeof mode);
  return mode == registration() ? ONI_STATUS_OK : ONI_STATUS_NOT_SUPPORTED;
}

/// A source cannot be registered anew, nor undone.
OniBool Device::isImageRegistrationModeSupported(OniImageRegistrationMode mode) {
  return mode == registration() ? TRUE : FALSE;
}

}  // namespace tactus::openni2_driver
