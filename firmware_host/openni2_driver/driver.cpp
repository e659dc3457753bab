// An OpenNI2 driver that plays a tactus source as a device: tactus://0 is what the environment names (settings.hpp), and
// tactus://SOURCE opens any other. Any OpenNI2 program can use it.
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstring>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "firmware_host/openni2_driver/device.hpp"
#include "firmware_host/openni2_driver/stream.hpp"

namespace tactus::openni2_driver {
namespace {

constexpr std::chrono::milliseconds kLookPeriod{20};

OniDeviceInfo info_of(const std::string& uri, const std::string& name) {
  OniDeviceInfo info{};
  const auto put = [](char (&field)[ONI_MAX_STR], const std::string& text) {
    std::memcpy(field, text.data(), std::min(text.size(), sizeof field - 1));
  };
  put(info.uri, uri);
  put(info.vendor, "tactus");
  put(info.name, name);
  return info;
}

class Driver final : public oni::driver::DriverBase {
 public:
  explicit Driver(OniDriverServices* services) : DriverBase(services) {}
  ~Driver() override { stop_watching(); }

  OniStatus initialize(oni::driver::DeviceConnectedCallback connected, oni::driver::DeviceDisconnectedCallback disconnected,
                       oni::driver::DeviceStateChangedCallback changed, void* cookie) override {
    (void)DriverBase::initialize(connected, disconnected, changed, cookie);
    const Settings settings = read_settings();
    if (settings.source.empty()) return ONI_STATUS_OK;
    first_ = info_of(first_uri(), settings.source);
    unplug_file_ = unplug_file();
    is_plugged_ = !is_asked_to_unplug();
    if (is_plugged_) announce(first_);
    if (!unplug_file_.empty()) watcher_ = std::thread([this] { watch(); });
    return ONI_STATUS_OK;
  }

  OniStatus tryDevice(const char* uri) override {
    const std::string name(uri);
    if (!name.starts_with(kUriPrefix) || name == first_uri() || name.size() >= ONI_MAX_STR) return ONI_STATUS_ERROR;
    announce(info_of(name, source_of(name)));
    return ONI_STATUS_OK;
  }

  oni::driver::DeviceBase* deviceOpen(const char* uri, const char*) override {
    Settings settings = read_settings();
    const bool is_first = uri == first_uri();
    if (!is_first) settings.source = source_of(uri);
    auto sensor = open_source(settings.source);
    if (!sensor) {
      getServices().errorLoggerAppend("%s", sensor.error().message.c_str());
      return nullptr;
    }
    auto* device = new Device(std::move(*sensor), std::move(settings));
    const std::lock_guard lock(mutex_);
    if (is_first) first_devices_.push_back(device);
    return device;
  }

  void deviceClose(oni::driver::DeviceBase* device) override {
    {
      const std::lock_guard lock(mutex_);
      std::erase(first_devices_, device);
    }
    delete device;
  }

  void shutdown() override { stop_watching(); }

  /// The group's handle is its player. One stream alone has nobody to come together with.
  void* enableFrameSync(oni::driver::StreamBase** streams, int count) override {
    SourcePlayer* player = nullptr;
    for (int i = 0; i < count; ++i) {
      auto* stream = dynamic_cast<Stream*>(streams[i]);
      if (stream == nullptr || (player != nullptr && player != &stream->player())) return nullptr;
      player = &stream->player();
    }
    if (player != nullptr) player->set_synced(count == 2);
    return player;
  }
  void disableFrameSync(void* group) override { static_cast<SourcePlayer*>(group)->set_synced(false); }

 private:
  static std::string first_uri() { return std::string(kUriPrefix) + "0"; }
  static std::string source_of(const std::string& uri) { return uri.substr(std::strlen(kUriPrefix)); }

  void announce(const OniDeviceInfo& info) {
    deviceConnected(&info);
    deviceStateChanged(&info, ONI_DEVICE_STATE_OK);
  }

  [[nodiscard]] bool is_asked_to_unplug() const { return !unplug_file_.empty() && access(unplug_file_.c_str(), F_OK) == 0; }

  void watch() {
    std::unique_lock lock(mutex_);
    while (!changed_.wait_for(lock, kLookPeriod, [this] { return is_stopping_; })) {
      const bool is_plugged = !is_asked_to_unplug();
      if (is_plugged == is_plugged_) continue;
      is_plugged_ = is_plugged;
      if (!is_plugged)
        for (Device* device : first_devices_) device->unplug();
      // The library may call back into this driver.
      lock.unlock();
      if (is_plugged)
        announce(first_);
      else
        deviceDisconnected(&first_);
      lock.lock();
    }
  }

  void stop_watching() {
    {
      const std::lock_guard lock(mutex_);
      is_stopping_ = true;
    }
    changed_.notify_all();
    if (watcher_.joinable()) watcher_.join();
  }

  OniDeviceInfo first_{};
  std::string unplug_file_;
  std::mutex mutex_;  // guards what follows
  std::condition_variable changed_;
  std::vector<Device*> first_devices_;
  bool is_plugged_ = true, is_stopping_ = false;
  std::thread watcher_;
};

}  // namespace
}  // namespace tactus::openni2_driver

ONI_EXPORT_DRIVER(tactus::openni2_driver::Driver)
