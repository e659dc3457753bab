#include "hal/libcamera/libcamera.hpp"

#include <algorithm>

#include "hal/libcamera/present/color_camera.hpp"
#include "hal/libcamera/present/manager.hpp"
#include "rt/clock.hpp"

namespace tactus::hal::libcamera {
namespace {

using Cameras = std::vector<std::shared_ptr<lc::Camera>>;

// A request that carries controls comes back with the first frame: a slow webcam takes a second to start.
constexpr rt::Duration kFirstFrame{3'000'000'000};

rt::Error unavailable(const std::string& what) { return {rt::ExitCode::device_unavailable, "libcamera" + what}; }
rt::Error about(const lc::Camera& camera, const rt::Error& error) {
  return {error.code, "libcamera:" + camera.id() + ": " + error.message};
}

std::string ids_of(const Cameras& cameras) {
  std::string text;
  for (const auto& camera : cameras) text += (text.empty() ? "" : ", ") + camera->id();
  return text;
}

std::string model_of(const lc::Camera& camera) {
  return camera.properties().get(lc::properties::Model).value_or("a camera");
}

rt::Result<std::shared_ptr<lc::Camera>> find_camera(const Cameras& cameras, const std::string& id) {
  if (cameras.empty()) return unavailable(": no camera. " + explain_no_camera());
  if (id.empty()) return cameras.front();
  Cameras matches;
  for (const auto& camera : cameras) {
    if (camera->id() == id) return camera;
    if (camera->id().find(id) != std::string::npos) matches.push_back(camera);
  }
  if (matches.empty())
    return unavailable(":" + id + ": no camera has this in its id; there are " + ids_of(cameras) + ".");
  if (matches.size() > 1)
    return rt::Error{rt::ExitCode::bad_usage, "libcamera:" + id + ": several cameras have this in their id; name more of " +
                                                  "one of " + ids_of(matches) + "."};
  return matches.front();
}

rt::Result<lc::StreamFormats> formats_of(lc::Camera& camera) {
  const std::unique_ptr<lc::CameraConfiguration> configuration = camera.generateConfiguration({lc::StreamRole::Viewfinder});
  if (!configuration || configuration->empty()) return unavailable(":" + camera.id() + ": has no stream for pictures.");
  return configuration->at(0).formats();
}

/// Empty: the camera is free. To ask for its modes probes a device; who streams from it should not notice.
std::string why_busy(lc::Camera& camera) {
  std::string why = acquire(camera);
  if (why.empty()) camera.release();
  return why;
}

/// False when the camera cannot be told a rate.
bool add_frame_rate(const lc::ControlInfoMap& offered, double rate_hz, std::vector<ControlSetting>& controls) {
  const auto limits = offered.find(lc::controls::FrameDurationLimits.id());
  if (limits == offered.end()) return false;
  const auto duration_us = static_cast<std::int64_t>(1e6 / rate_hz + 0.5);
  const std::vector<std::int64_t> both{duration_us, duration_us};
  controls.push_back({lc::controls::FrameDurationLimits.id(), lc::ControlValue(lc::Span<const std::int64_t>(both))});
  return true;
}

}  // namespace

rt::Result<LiveCamera<ColorCamera>> open_color(const LibcameraRequest& request) {
  auto manager = camera_manager();
  if (!manager) return manager.error();
  const auto camera = find_camera((*manager)->cameras(), request.id);
  if (!camera) return camera.error();
  if (const std::string busy = why_busy(**camera); !busy.empty())
    return unavailable(":" + (*camera)->id() + ": " + busy + ".");
  const auto formats = formats_of(**camera);
  if (!formats) return formats.error();
  const auto choice = choose_format(*formats, request.mode, request.format);
  if (!choice) return about(**camera, choice.error());
  auto controls = parse_controls((*camera)->controls(), request.controls);
  if (!controls) return about(**camera, controls.error());

  LiveCamera<ColorCamera> live;
  Mode mode{*choice, std::move(*controls)};
  if (request.mode.frame_rate_hz > 0) {
    live.frame_rate_hz = request.mode.frame_rate_hz;
    if (!add_frame_rate((*camera)->controls(), request.mode.frame_rate_hz, mode.controls))
      live.notes.push_back("libcamera cannot tell this camera a frame rate; it keeps its own.");
  }
  const bool has_controls = !mode.controls.empty();
  auto wake = std::make_unique<Wake>();
  auto keeper = std::make_unique<Keeper>(**manager, *camera, std::move(mode), *wake);
  const auto session = keeper->open();
  if (!session) return session.error();
  if (has_controls) {
    const rt::HostTime deadline = rt::Clock::monotonic().now() + kFirstFrame;
    while (!(*session)->controls_taken() && wake->wait_until(deadline)) {
    }
    if (!(*session)->controls_taken().value_or(true))
      return rt::Error{rt::ExitCode::bad_usage, "libcamera:" + (*camera)->id() +
                                                    ": the driver refuses these controls together; set fewer of them "
                                                    "(ExposureTime needs AeEnable=false)."};
  }
  live.width = static_cast<int>(choice->size.width);
  live.height = static_cast<int>(choice->size.height);
  live.has_host_clock = true;
  live.buffers_bytes = (*session)->buffers_bytes();
  live.description = "libcamera " + model_of(**camera) + " (" + (*camera)->id() + "), " + choice->theirs.toString() + " " +
                     choice->size.toString() + ", " + std::to_string((*session)->requests_count()) + " mapped dma-bufs";
  live.camera = std::make_unique<LibcameraColor>(std::move(*manager), std::move(wake), std::move(keeper), **session);
  return live;
}

DeviceList list_devices() {
  DeviceList list{"libcamera", {}, {}};
  const auto manager = camera_manager();
  if (!manager) {
    list.why_none = manager.error().message;
    return list;
  }
  for (const auto& camera : (*manager)->cameras()) {
    DeviceEntry entry{"libcamera:" + camera->id(), model_of(*camera), {}, {}};
    if (const std::string busy = why_busy(*camera); !busy.empty())
      entry.trouble = "It " + busy + ".";
    else if (const auto formats = formats_of(*camera))
      entry.formats = describe(*formats);
    else
      entry.trouble = formats.error().message;
    const bool can_be_taken = std::any_of(entry.formats.begin(), entry.formats.end(),
                                          [](const std::string& line) { return line.starts_with("color "); });
    if (entry.trouble.empty() && !can_be_taken) entry.trouble = "It has none of BGR888, YUYV, NV12 and MJPEG.";
    list.devices.push_back(std::move(entry));
  }
  if (list.devices.empty()) list.why_none = explain_no_camera();
  return list;
}

}  // namespace tactus::hal::libcamera
