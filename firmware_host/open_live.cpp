#include "firmware_host/open_live.hpp"

#include <utility>

#include "hal/iio/accelerometer.hpp"
#include "hal/libcamera/libcamera.hpp"
#include "hal/openni2/openni2.hpp"
#include "hal/v4l2/v4l2.hpp"

namespace tactus::firmware {
namespace {

hal::ModeRequest mode_or(hal::ModeRequest asked, const hal::ModeRequest& otherwise) {
  if (asked.width == 0) {
    asked.width = otherwise.width;
    asked.height = otherwise.height;
  }
  if (asked.frame_rate_hz <= 0) asked.frame_rate_hz = otherwise.frame_rate_hz;
  return asked;
}

hal::v4l2::Buffers buffers_of(const std::string& name) {
  if (name == "userptr") return hal::v4l2::Buffers::userptr;
  return name == "dmabuf" ? hal::v4l2::Buffers::dmabuf : hal::v4l2::Buffers::mmap;
}

rt::Result<hal::LiveCamera<hal::ColorCamera>> open_color(const LiveSource& source, const LiveDefaults& defaults) {
  const hal::ModeRequest mode = mode_or(source.color_mode, defaults.mode);
  constexpr std::string_view kLibcamera = "libcamera";
  if (source.color.starts_with(kLibcamera)) {
    const std::string id = source.color.size() > kLibcamera.size() ? source.color.substr(kLibcamera.size() + 1) : "";
    return hal::libcamera::open_color({id, mode, source.color_format, source.color_controls});
  }
  // The exporter of depth's buffers is one node, which cannot give to both.
  return hal::v4l2::open_color({source.color, mode, source.color_format,
                                source.dmabuf_exporter.empty() ? buffers_of(source.buffers) : hal::v4l2::Buffers::mmap,
                                "", source.color_controls});
}

rt::Result<hal::Sensor> open_v4l2(const LiveSource& source, const LiveDefaults& defaults) {
  auto depth = hal::v4l2::open_depth({source.device, mode_or(source.mode, defaults.mode), source.format,
                                      buffers_of(source.buffers), source.dmabuf_exporter, source.controls});
  if (!depth) return depth.error();
  std::optional<hal::LiveCamera<hal::ColorCamera>> color;
  if (!source.color.empty()) {
    auto opened = open_color(source, defaults);
    if (!opened) return opened.error();
    color = std::move(*opened);
  }
  return compose_sensor(std::move(*depth), std::move(color), source.calibration);
}

/// Puts another device's colour in the place of the sensor's own.
rt::Result<void> add_color(hal::Sensor& sensor, hal::LiveCamera<hal::ColorCamera> color,
                           const std::string& calibration_file) {
  sensor.description += "; colour: " + color.description;
  sensor.notes.insert(sensor.notes.end(), color.notes.begin(), color.notes.end());
  sensor.buffers_bytes += color.buffers_bytes;
  sensor.has_two_clocks = true;  // OpenNI2's devices keep a clock of their own
  sensor.color = std::move(color.camera);
  hal::RigCalibration& rig = sensor.calibration;
  rig.has_color = true;
  rig.registered = false;
  rig.color = assumed_calibration({}, {color.width, color.height}).color;
  rig.T_color_depth = {};
  if (calibration_file.empty())
    sensor.notes.push_back(
        "nothing is known of where the colour camera is: at the depth camera's place and 62.7 degrees across are assumed; "
        "say ?calibration=FILE.toml");
  return {};
}

rt::Result<hal::Sensor> open_openni2(const LiveSource& source, const LiveDefaults& defaults) {
  hal::openni2::OpenNi2Request request;
  request.uri = source.device;
  request.mode = mode_or(source.mode, defaults.mode);
  request.wants_color = source.color.empty();
  request.wants_registered = request.wants_color && source.is_registered.value_or(true);
  request.wants_sync = request.wants_color && source.is_synchronized.value_or(true);
  auto sensor = hal::openni2::open_openni2(request);
  if (!sensor) return sensor;
  const bool needs_registered = source.is_registered.value_or(defaults.needs_registered) && request.wants_color;
  if (needs_registered && !(sensor->color && sensor->calibration.registered))
    return rt::Error{rt::ExitCode::device_unavailable,
                     sensor->description + ": this device does not register depth to colour; leave that to the "
                                           "calibration with registered=0."};
  if (!source.color.empty()) {
    auto color = open_color(source, defaults);
    if (!color) return color.error();
    if (auto added = add_color(*sensor, std::move(*color), source.calibration); !added) return added.error();
  }
  if (!source.calibration.empty()) {
    const hal::RigCalibration& own = sensor->calibration;
    auto rig = calibration_for(source.calibration, {own.depth.width, own.depth.height},
                               own.has_color ? ImageSize{own.color.width, own.color.height} : ImageSize{}, sensor->notes);
    if (!rig) return rig.error();
    if (own.registered != rig->registered && source.color.empty() && own.has_color)
      return rt::Error{rt::ExitCode::bad_usage,
                       source.calibration + ": registered = " + (rig->registered ? "true" : "false") +
                           ", but the device delivers depth " + (own.registered ? "" : "not ") +
                           "registered; say registered=" + (rig->registered ? "1." : "0.")};
    sensor->calibration = *rig;
  }
  return sensor;
}

rt::Result<void> add_gravity(hal::Sensor& sensor, const std::string& accelerometer) {
  if (accelerometer.empty()) return {};
  const std::string folder =
      accelerometer.starts_with('/') ? accelerometer : "/sys/bus/iio/devices/" + accelerometer;
  const auto gravity = hal::iio::read_gravity(folder, Rotation{});
  if (!gravity) return gravity.error();
  if (!*gravity)
    return rt::Error{rt::ExitCode::device_unavailable,
                     "accelerometer=" + accelerometer + ": there is no accelerometer; `tactus devices` lists them."};
  sensor.gravity_depth = **gravity;
  return {};
}

}  // namespace

rt::Result<hal::Sensor> open_live(const LiveSource& source, const LiveDefaults& defaults) {
  auto sensor = source.kind == LiveKind::v4l2 ? open_v4l2(source, defaults) : open_openni2(source, defaults);
  if (!sensor) return sensor;
  if (auto added = add_gravity(*sensor, source.accelerometer); !added) return added.error();
  return sensor;
}

std::vector<hal::DeviceList> list_all_devices() {
  return {hal::openni2::list_devices(), hal::v4l2::list_devices(), hal::libcamera::list_devices(),
          hal::iio::find_accelerometers()};
}

}  // namespace tactus::firmware
