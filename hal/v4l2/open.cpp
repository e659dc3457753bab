#include "hal/frames/convert.hpp"
#include "hal/v4l2/live_device.hpp"
#include "hal/v4l2/v4l2.hpp"
#include "rt/heap_guard.hpp"

namespace tactus::hal::v4l2 {
namespace {

class V4l2DepthCamera final : public DepthCamera {
 public:
  static constexpr Stream kStream = Stream::depth;
  explicit V4l2DepthCamera(std::unique_ptr<LiveDevice> device) : device_(std::move(device)) {}

  rt::Status read(std::span<std::uint16_t> depth, FrameHeader& header, rt::Duration timeout) override {
    rt::Status status = device_->acquire(timeout);
    if (status != rt::Status::ok) return status;
    header = device_->frame().header;
    if (tap_ != nullptr) tap_->take(kStream, device_->frame());
    status = frames::to_depth(device_->frame(), depth);
    device_->release(status);
    return status;
  }
  [[nodiscard]] const CameraCounters& counters() const override { return device_->counters(); }

 private:
  std::unique_ptr<LiveDevice> device_;
};

class V4l2ColorCamera final : public ColorCamera {
 public:
  static constexpr Stream kStream = Stream::color;
  explicit V4l2ColorCamera(std::unique_ptr<LiveDevice> device) : device_(std::move(device)) {}

  rt::Status read(std::span<std::uint8_t> rgb, FrameHeader& header, rt::Duration timeout) override {
    rt::Status status = device_->acquire(timeout);
    if (status != rt::Status::ok) return status;
    header = device_->frame().header;
    if (tap_ != nullptr) tap_->take(kStream, device_->frame());
    status = convert(rgb);
    device_->release(status);
    return status;
  }
  rt::Status peek(FrameHeader& header, rt::Duration timeout) override {
    const rt::Status status = device_->acquire(timeout);
    if (status == rt::Status::ok) header = device_->frame().header;
    return status;
  }
  void skip() override {
    if (device_->acquire({}) != rt::Status::ok) return;
    if (tap_ != nullptr) tap_->take(kStream, device_->frame());
    device_->release(rt::Status::ok);
  }
  [[nodiscard]] const CameraCounters& counters() const override { return device_->counters(); }

 private:
  rt::Status convert(std::span<std::uint8_t> rgb) {
    const RawFrame& frame = device_->frame();
    if (frame.format != PixelFormat::mjpeg) return frames::to_rgb(frame, rgb);
    const rt::GuestScope libjpeg;
    return frames::to_rgb(frame, rgb);
  }

  std::unique_ptr<LiveDevice> device_;
};

template <typename CameraKind, typename Implementation>
rt::Result<LiveCamera<CameraKind>> open(const V4l2Request& request) {
  auto device = std::make_unique<LiveDevice>(request.buffers, request.dmabuf_exporter);
  if (auto opened = device->open(request, Implementation::kStream); !opened) return opened.error();
  LiveCamera<CameraKind> out;
  const Agreement& agreement = device->agreement();
  out.width = agreement.width;
  out.height = agreement.height;
  out.frame_rate_hz = agreement.frame_rate_hz;
  out.has_host_clock = device->has_host_clock();
  out.buffers_bytes = device->buffers_bytes();
  out.description = device->description();
  out.notes = agreement.notes;
  out.notes.push_back(device->time_note());
  out.camera = std::make_unique<Implementation>(std::move(device));
  return out;
}

}  // namespace

rt::Result<LiveCamera<DepthCamera>> open_depth(const V4l2Request& request) {
  return open<DepthCamera, V4l2DepthCamera>(request);
}

rt::Result<LiveCamera<ColorCamera>> open_color(const V4l2Request& request) {
  return open<ColorCamera, V4l2ColorCamera>(request);
}

}  // namespace tactus::hal::v4l2
