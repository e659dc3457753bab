#include "hal/openni2/present/live_device.hpp"

#include <algorithm>
#include <cstring>
#include <span>

#include "hal/frames/convert.hpp"
#include "hal/openni2/present/modes.hpp"

namespace tactus::hal::openni2 {
namespace {

constexpr rt::Duration kLookPeriod{500'000'000};

/// False: the device does not say.
template <typename Value>
bool get(OniStreamHandle stream, int property, Value& value) {
  int bytes = sizeof value;
  return oniStreamGetProperty(stream, property, &value, &bytes) == ONI_STATUS_OK;
}

std::span<const OniVideoMode> modes_of(OniDeviceHandle device, OniSensorType sensor) {
  const OniSensorInfo* info = oniDeviceGetSensorInfo(device, sensor);
  if (info == nullptr || info->numSupportedVideoModes < 1) return {};
  return {info->pSupportedVideoModes, static_cast<std::size_t>(info->numSupportedVideoModes)};
}

bool is_same_kind(const OniDeviceInfo& a, const OniDeviceInfo& b) {
  return std::strcmp(a.vendor, b.vendor) == 0 && std::strcmp(a.name, b.name) == 0 && a.usbVendorId == b.usbVendorId &&
         a.usbProductId == b.usbProductId;
}

/// Returns when both streams have just given a frame and are quiet for most of a frame's time, or after 0.1 s without.
void await_quiet(OniStreamHandle depth, OniStreamHandle color) {
  OniStreamHandle streams[2] = {depth, color};
  bool has_come[2] = {false, false};
  constexpr int kPatience_ms = 100;
  int index = 0;
  for (int i = 0; i < 8 && !(has_come[0] && has_come[1]); ++i) {
    if (oniWaitForAnyStream(streams, 2, &index, kPatience_ms) != ONI_STATUS_OK) return;
    OniFrame* frame = nullptr;
    (void)oniStreamReadFrame(streams[index], &frame);
    if (frame != nullptr) oniFrameRelease(frame);
    has_come[index] = true;
  }
}

}  // namespace

rt::Result<std::shared_ptr<LiveDevice>> LiveDevice::open(const OpenNi2Request& request) {
  auto library = Library::get();
  if (!library) return library.error();
  std::shared_ptr<LiveDevice> device(new LiveDevice(**library, request));
  rt::Result<void> opened;
  device->library_.call([&] { opened = device->open_first(); });
  if (!opened) return opened.error();
  return device;
}

LiveDevice::~LiveDevice() {
  library_.call([this] {
    library_.remove(*this);
    close();
    depth.intake.reset();
    if (color) color->intake.reset();
  });
}

rt::Error LiveDevice::trouble(const std::string& what) const {
  const std::string words = last_words();
  const std::string name = watched_uri_.empty() ? "openni2" : "openni2:" + watched_uri_;
  return {rt::ExitCode::device_unavailable, name + ": " + what + (words.empty() ? "" : " (" + words + ")") + "."};
}

rt::Result<void> LiveDevice::open_first() {
  std::string uri = request_.uri;
  if (uri.empty()) {
    const auto devices = library_.devices();
    if (devices.empty()) return trouble("no OpenNI2 device is plugged in, or its driver is not installed");
    uri = devices.front().uri;
  }
  auto connected = connect(uri);
  if (!connected) {
    close();
    return connected;
  }
  library_.add(*this);
  // Lost in between: nobody was told.
  const auto devices = library_.devices();
  if (std::none_of(devices.begin(), devices.end(), [&](const auto& d) { return std::strcmp(d.uri, info_.uri) == 0; }))
    on_lost(info_);
  return {};
}

rt::Result<void> LiveDevice::connect(const std::string& uri) {
  {
    const std::lock_guard lock(watched_mutex_);
    watched_uri_ = uri;
  }
  is_lost_.store(false, std::memory_order_relaxed);
  if (oniDeviceOpen(uri.c_str(), &device_) != ONI_STATUS_OK) {
    device_ = nullptr;
    return trouble("cannot be opened; is it plugged in, free, and may this user use it?");
  }
  (void)oniDeviceGetInfo(device_, &info_);
  if (auto opened = open_stream(ONI_SENSOR_DEPTH, depth, depth_stream_); !opened) return opened;
  if (!is_planned_ && request_.wants_color && !modes_of(device_, ONI_SENSOR_COLOR).empty()) color.emplace();
  if (color)
    if (auto opened = open_stream(ONI_SENSOR_COLOR, *color, color_stream_); !opened) return opened;
  if (color) set_registration();
  if (oniStreamStart(depth_stream_) != ONI_STATUS_OK) return trouble("its depth stream does not start");
  if (color && oniStreamStart(color_stream_) != ONI_STATUS_OK) return trouble("its colour stream does not start");
  if (color) start_sync();
  clock_.begin_connection();
  depth.intake->connect();
  if (color) color->intake->connect();
  library_.add(*depth.intake, depth_stream_);
  if (color) library_.add(*color->intake, color_stream_);
  is_planned_ = true;
  return {};
}

rt::Result<void> LiveDevice::open_stream(OniSensorType sensor, LiveStream& stream, OniStreamHandle& handle) {
  const char* name = sensor == ONI_SENSOR_DEPTH ? "depth" : "colour";
  if (modes_of(device_, sensor).empty()) return trouble(std::string("the device has no ") + name + " camera");
  if (oniDeviceCreateStream(device_, sensor, &handle) != ONI_STATUS_OK) {
    handle = nullptr;
    return trouble(std::string("its ") + name + " stream cannot be opened");
  }
  if (!is_planned_)
    if (auto chosen = choose(sensor, handle, stream); !chosen) return chosen;
  OniVideoMode set{};
  const bool is_set = get(handle, ONI_STREAM_PROPERTY_VIDEO_MODE, set) && std::memcmp(&set, &stream.mode, sizeof set) == 0;
  if (!is_set &&
      oniStreamSetProperty(handle, ONI_STREAM_PROPERTY_VIDEO_MODE, &stream.mode, sizeof stream.mode) != ONI_STATUS_OK)
    return trouble("the mode " + to_string(stream.mode) + " cannot be set");
  const OniBool is_mirrored = FALSE;
  if (oniStreamIsPropertySupported(handle, ONI_STREAM_PROPERTY_MIRRORING))
    (void)oniStreamSetProperty(handle, ONI_STREAM_PROPERTY_MIRRORING, &is_mirrored, sizeof is_mirrored);
  float fov_x_rad = 0, fov_y_rad = 0;
  (void)get(handle, ONI_STREAM_PROPERTY_HORIZONTAL_FOV, fov_x_rad);
  (void)get(handle, ONI_STREAM_PROPERTY_VERTICAL_FOV, fov_y_rad);
  stream.seen = {stream.mode.resolutionX, stream.mode.resolutionY, fov_x_rad, fov_y_rad};
  if (!stream.intake) {
    // A JPEG is given the room of its pixels, as the library's own drivers do.
    const PixelFormat room = stream.format == PixelFormat::mjpeg ? PixelFormat::rgb24 : stream.format;
    stream.intake = std::make_unique<StreamIntake>(
        clock_, frames::packed_bytes(room, stream.mode.resolutionX, stream.mode.resolutionY));
  }
  stream.intake->buffers().hand_to(handle);
  return {};
}

rt::Result<void> LiveDevice::choose(OniSensorType sensor, OniStreamHandle handle, LiveStream& stream) {
  const bool is_depth = sensor == ONI_SENSOR_DEPTH;
  const auto modes = modes_of(device_, sensor);
  OniVideoMode current{};
  (void)get(handle, ONI_STREAM_PROPERTY_VIDEO_MODE, current);
  const auto mode = is_depth ? choose_mode(modes, current, request_.mode) : choose_color_mode(modes, current, depth.mode);
  if (!mode) {
    std::string has;
    for (const OniVideoMode& m : modes)
      if (format_of(m.pixelFormat)) has += (has.empty() ? "" : ", ") + to_string(m);
    rt::Error error = trouble(has.empty() ? "its camera has no mode that can be used"
                                          : "the mode asked for is not among those it has: " + has);
    error.code = has.empty() ? rt::ExitCode::device_unavailable : rt::ExitCode::bad_usage;
    return error;
  }
  stream.mode = *mode;
  stream.format = *format_of(mode->pixelFormat);
  return {};
}

void LiveDevice::set_registration() {
  const bool can = oniDeviceIsImageRegistrationModeSupported(device_, ONI_IMAGE_REGISTRATION_DEPTH_TO_COLOR) == TRUE;
  OniImageRegistrationMode mode = can && request_.wants_registered ? ONI_IMAGE_REGISTRATION_DEPTH_TO_COLOR
                                                                   : ONI_IMAGE_REGISTRATION_OFF;
  (void)oniDeviceSetProperty(device_, ONI_DEVICE_PROPERTY_IMAGE_REGISTRATION, &mode, sizeof mode);
  int bytes = sizeof mode;
  if (oniDeviceGetProperty(device_, ONI_DEVICE_PROPERTY_IMAGE_REGISTRATION, &mode, &bytes) != ONI_STATUS_OK)
    mode = ONI_IMAGE_REGISTRATION_OFF;
  is_registered_ = mode == ONI_IMAGE_REGISTRATION_DEPTH_TO_COLOR;
}

/// After both have started: before that the library joins streams that it does not yet believe to be running. It exchanges
/// their queues while frames may come, without a lock; right after the start none do.
void LiveDevice::start_sync() {
  is_synced_ = request_.wants_sync && oniDeviceEnableDepthColorSync(device_) == ONI_STATUS_OK;
}

void LiveDevice::close() {
  if (depth.intake) library_.remove(*depth.intake);
  if (color && color->intake) library_.remove(*color->intake);
  if (is_synced_) {
    // The same exchange as in start_sync(), with the streams running.
    if (!is_lost_.load(std::memory_order_relaxed)) await_quiet(depth_stream_, color_stream_);
    oniDeviceDisableDepthColorSync(device_);
    is_synced_ = false;
  }
  for (OniStreamHandle* stream : {&color_stream_, &depth_stream_}) {
    if (*stream == nullptr) continue;
    oniStreamStop(*stream);
    oniStreamDestroy(*stream);
    *stream = nullptr;
  }
  if (device_ != nullptr) (void)oniDeviceClose(device_);
  device_ = nullptr;
  if (depth.intake) depth.intake->disconnect();
  if (color && color->intake) color->intake->disconnect();
}

void LiveDevice::on_lost(const OniDeviceInfo& info) {
  {
    const std::lock_guard lock(watched_mutex_);
    if (watched_uri_ != info.uri) return;
  }
  is_lost_.store(true, std::memory_order_relaxed);
  tell_readers();
}

void LiveDevice::tell_readers() {
  if (depth.intake) depth.intake->lose();
  if (color && color->intake) color->intake->lose();
}

std::optional<OniDeviceInfo> LiveDevice::find_again() {
  const auto devices = library_.devices();
  for (const OniDeviceInfo& info : devices)
    if (std::strcmp(info.uri, info_.uri) == 0) return info;
  const auto same = std::find_if(devices.begin(), devices.end(),
                                 [this](const OniDeviceInfo& info) { return is_same_kind(info, info_); });
  if (same == devices.end()) return std::nullopt;
  return *same;
}

void LiveDevice::tend(rt::HostTime now) {
  // Relaxed: a flag alone; what it is about is the device, which only this thread touches.
  if (!is_lost_.load(std::memory_order_relaxed)) return;
  if (device_ != nullptr) {
    tell_readers();
    close();
    next_look_ = now;
  }
  if (now < next_look_) return;
  next_look_ = now + kLookPeriod;
  const auto found = find_again();
  if (!found) return;
  if (connect(found->uri)) return;
  close();
  is_lost_.store(true, std::memory_order_relaxed);
}

}  // namespace tactus::hal::openni2
