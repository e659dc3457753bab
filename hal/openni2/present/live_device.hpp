// An opened device and its two streams, through its absences.
#pragma once

#include <OniCAPI.h>

#include <atomic>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "hal/openni2/openni2.hpp"
#include "hal/openni2/present/assumed_calibration.hpp"
#include "hal/openni2/present/library.hpp"
#include "hal/openni2/present/stream_intake.hpp"

namespace tactus::hal::openni2 {

struct LiveStream {
  OniVideoMode mode{};
  PixelFormat format = PixelFormat::depth16;
  SeenFrom seen;
  std::unique_ptr<StreamIntake> intake;
};

class LiveDevice final : public Tended {
 public:
  /// As open_openni2(). Boot.
  static rt::Result<std::shared_ptr<LiveDevice>> open(const OpenNi2Request& request);
  LiveDevice(const LiveDevice&) = delete;
  LiveDevice& operator=(const LiveDevice&) = delete;
  ~LiveDevice() override;

  void on_lost(const OniDeviceInfo& info) override;
  /// Closes a device that is away, looks for it twice a second and opens it again.
  void tend(rt::HostTime now) override;

  [[nodiscard]] const OniDeviceInfo& info() const { return info_; }
  [[nodiscard]] bool is_registered() const { return is_registered_; }
  [[nodiscard]] bool is_synced() const { return is_synced_; }
  LiveStream depth;
  std::optional<LiveStream> color;

 private:
  LiveDevice(Library& library, const OpenNi2Request& request) : library_(library), request_(request) {}
  rt::Result<void> open_first();
  rt::Result<void> connect(const std::string& uri);
  rt::Result<void> open_stream(OniSensorType sensor, LiveStream& stream, OniStreamHandle& handle);
  rt::Result<void> choose(OniSensorType sensor, OniStreamHandle handle, LiveStream& stream);
  void set_registration();
  void start_sync();
  void close();
  void tell_readers();
  rt::Error trouble(const std::string& what) const;
  /// The device itself at another place of the bus counts as the same.
  std::optional<OniDeviceInfo> find_again();

  Library& library_;
  OpenNi2Request request_;
  OniDeviceInfo info_{};
  DeviceClock clock_;
  bool is_planned_ = false, is_registered_ = false, is_synced_ = false;
  OniDeviceHandle device_ = nullptr;
  OniStreamHandle depth_stream_ = nullptr, color_stream_ = nullptr;
  rt::HostTime next_look_;
  std::atomic<bool> is_lost_{false};
  std::mutex watched_mutex_;  // guards watched_uri_, which drivers' threads compare
  std::string watched_uri_;
};

}  // namespace tactus::hal::openni2
