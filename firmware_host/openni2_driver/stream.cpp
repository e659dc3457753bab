#include "firmware_host/openni2_driver/stream.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace tactus::openni2_driver {
namespace {

template <typename Value>
OniStatus answer(const Value& value, void* data, int* bytes) {
  if (*bytes < static_cast<int>(sizeof value)) return ONI_STATUS_BAD_PARAMETER;
  std::memcpy(data, &value, sizeof value);
  *bytes = sizeof value;
  return ONI_STATUS_OK;
}

float field_of_view_rad(int pixels, double focal_px) { return static_cast<float>(2 * std::atan(pixels / (2 * focal_px))); }

}  // namespace

OniVideoMode Stream::mode_of(const hal::Sensor& sensor, hal::Stream kind) {
  const bool is_depth = kind == hal::Stream::depth;
  const hal::Intrinsics& k = is_depth ? sensor.calibration.depth : sensor.calibration.color;
  return {is_depth ? ONI_PIXEL_FORMAT_DEPTH_1_MM : ONI_PIXEL_FORMAT_RGB888, k.width, k.height,
          static_cast<int>(std::lround(sensor.frame_rate_hz))};
}

Stream::Stream(SourcePlayer& player, hal::Stream kind)
    : player_(player), kind_(kind), mode_(mode_of(player.sensor(), kind)) {}

Stream::~Stream() { stop(); }

OniStatus Stream::start() {
  player_.start(kind_, *this);
  return ONI_STATUS_OK;
}

void Stream::stop() { player_.stop(kind_); }

OniBool Stream::isPropertySupported(int property) {
  switch (property) {
    case ONI_STREAM_PROPERTY_VIDEO_MODE:
    case ONI_STREAM_PROPERTY_HORIZONTAL_FOV:
    case ONI_STREAM_PROPERTY_VERTICAL_FOV:
    case ONI_STREAM_PROPERTY_MIRRORING:
    case ONI_STREAM_PROPERTY_CROPPING:
    case ONI_STREAM_PROPERTY_STRIDE:
      return TRUE;
    case ONI_STREAM_PROPERTY_MIN_VALUE:
    case ONI_STREAM_PROPERTY_MAX_VALUE:
      return is_depth() ? TRUE : FALSE;
    default:
      return FALSE;
  }
}

OniStatus Stream::getProperty(int property, void* data, int* bytes) {
  const hal::RigCalibration& rig = player_.sensor().calibration;
  const hal::Intrinsics& k = is_depth() ? rig.depth : rig.color;
  switch (property) {
    case ONI_STREAM_PROPERTY_VIDEO_MODE:
      return answer(mode_, data, bytes);
    case ONI_STREAM_PROPERTY_HORIZONTAL_FOV:
      return answer(field_of_view_rad(k.width, k.fx), data, bytes);
    case ONI_STREAM_PROPERTY_VERTICAL_FOV:
      return answer(field_of_view_rad(k.height, k.fy), data, bytes);
    case ONI_STREAM_PROPERTY_MIRRORING:
      return answer(OniBool{FALSE}, data, bytes);
    case ONI_STREAM_PROPERTY_CROPPING:
      return answer(OniCropping{}, data, bytes);
    case ONI_STREAM_PROPERTY_STRIDE:
      return answer(row_bytes(), data, bytes);
    case ONI_STREAM_PROPERTY_MIN_VALUE:
      return is_depth() ? answer(0, data, bytes) : ONI_STATUS_NOT_SUPPORTED;
    case ONI_STREAM_PROPERTY_MAX_VALUE:
      return is_depth() ? answer(SourcePlayer::kDepthMax_mm, data, bytes) : ONI_STATUS_NOT_SUPPORTED;
    default:
      return ONI_STATUS_NOT_SUPPORTED;
  }
}

/// A recording is as it is: what it has already can be asked for, nothing else.
OniStatus Stream::setProperty(int property, const void* data, int bytes) {
  const auto is_value = [&](const auto& value) {
    return bytes == static_cast<int>(sizeof value) && std::memcmp(data, &value, sizeof value) == 0;
  };
  switch (property) {
    case ONI_STREAM_PROPERTY_VIDEO_MODE:
      return is_value(mode_) ? ONI_STATUS_OK : ONI_STATUS_NOT_SUPPORTED;
    case ONI_STREAM_PROPERTY_MIRRORING:
      return is_value(OniBool{FALSE}) ? ONI_STATUS_OK : ONI_STATUS_NOT_SUPPORTED;
    case ONI_STREAM_PROPERTY_CROPPING:
      return bytes == sizeof(OniCropping) && static_cast<const OniCropping*>(data)->enabled == 0 ? ONI_STATUS_OK
                                                                                                 : ONI_STATUS_NOT_SUPPORTED;
    default:
      return ONI_STATUS_NOT_SUPPORTED;
  }
}

void Stream::show(std::span<const std::uint8_t> pixels, std::uint64_t time_us, int index) {
  OniFrame* frame = getServices().acquireFrame();
  if (frame == nullptr) return;
  frame->sensorType = is_depth() ? ONI_SENSOR_DEPTH : ONI_SENSOR_COLOR;
  frame->videoMode = mode_;
  frame->width = mode_.resolutionX;
  frame->height = mode_.resolutionY;
  frame->stride = row_bytes();
  frame->croppingEnabled = FALSE;
  frame->cropOriginX = frame->cropOriginY = 0;
  frame->timestamp = time_us;
  frame->frameIndex = index;
  const std::size_t bytes = std::min(pixels.size(), static_cast<std::size_t>(frame->dataSize));
  std::memcpy(frame->data, pixels.data(), bytes);
  frame->dataSize = static_cast<int>(bytes);
  raiseNewFrame(frame);
  getServices().releaseFrame(frame);
}

}  // namespace tactus::openni2_driver
