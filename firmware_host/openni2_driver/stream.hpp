// One stream of the device, as OpenNI2 sees it.
#pragma once

#include "firmware_host/openni2_driver/openni2_api.hpp"
#include "firmware_host/openni2_driver/source_player.hpp"

namespace tactus::openni2_driver {

class Stream final : public oni::driver::StreamBase, private FrameSink {
 public:
  Stream(SourcePlayer& player, hal::Stream kind);
  ~Stream() override;

  OniStatus start() override;
  void stop() override;
  OniBool isPropertySupported(int property) override;
  OniStatus getProperty(int property, void* data, int* bytes) override;
  OniStatus setProperty(int property, const void* data, int bytes) override;

  [[nodiscard]] SourcePlayer& player() { return player_; }
  static OniVideoMode mode_of(const hal::Sensor& sensor, hal::Stream kind);

 private:
  void show(std::span<const std::uint8_t> pixels, std::uint64_t time_us, int index) override;
  [[nodiscard]] bool is_depth() const { return kind_ == hal::Stream::depth; }
  [[nodiscard]] int row_bytes() const { return mode_.resolutionX * (is_depth() ? 2 : 3); }

  SourcePlayer& player_;
  hal::Stream kind_;
  OniVideoMode mode_;
};

}  // namespace tactus::openni2_driver
