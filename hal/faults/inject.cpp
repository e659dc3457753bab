#include <utility>

#include "hal/faults/faulty_stream.hpp"

namespace tactus::hal::faults {
namespace {

/// Gives a depth camera the peek and skip that colour cameras have.
class DepthAhead {
 public:
  DepthAhead(std::unique_ptr<DepthCamera> camera, std::size_t values_count)
      : camera_(std::move(camera)), depth_(values_count) {}

  rt::Status peek(FrameHeader& header, rt::Duration timeout) {
    if (!is_full_) {
      const rt::Status status = camera_->read(depth_, header_, timeout);
      if (status != rt::Status::ok) return status;
      is_full_ = true;
    }
    header = header_;
    return rt::Status::ok;
  }
  rt::Status read(std::span<std::uint16_t> depth, FrameHeader& header, rt::Duration timeout) {
    const rt::Status status = peek(header, timeout);
    if (status != rt::Status::ok) return status;
    std::memcpy(depth.data(), depth_.data(), depth.size_bytes());
    is_full_ = false;
    return status;
  }
  void skip() { is_full_ = false; }
  [[nodiscard]] const CameraCounters& counters() const { return camera_->counters(); }
  void set_tap(FrameTap* tap) { camera_->set_tap(tap); }

 private:
  std::unique_ptr<DepthCamera> camera_;
  std::vector<std::uint16_t> depth_;
  FrameHeader header_;
  bool is_full_ = false;
};

class FaultyDepthCamera final : public DepthCamera {
 public:
  FaultyDepthCamera(std::unique_ptr<DepthCamera> camera, const StreamSetup& setup)
      : stream_(std::make_unique<DepthAhead>(std::move(camera), setup.values_count), setup) {}
  rt::Status read(std::span<std::uint16_t> depth, FrameHeader& header, rt::Duration timeout) override {
    return stream_.read(depth, header, timeout);
  }
  void set_tap(FrameTap* tap) override { stream_.source().set_tap(tap); }
  [[nodiscard]] const CameraCounters& counters() const override { return stream_.counters(); }
  [[nodiscard]] std::size_t slots_bytes() const { return stream_.slots_bytes(); }

 private:
  FaultyStream<DepthAhead, std::uint16_t> stream_;
};

class FaultyColorCamera final : public ColorCamera {
 public:
  FaultyColorCamera(std::unique_ptr<ColorCamera> camera, const StreamSetup& setup) : stream_(std::move(camera), setup) {}
  rt::Status read(std::span<std::uint8_t> rgb, FrameHeader& header, rt::Duration timeout) override {
    return stream_.read(rgb, header, timeout);
  }
  rt::Status peek(FrameHeader& header, rt::Duration timeout) override { return stream_.peek(header, timeout); }
  void skip() override { stream_.skip(); }
  void set_tap(FrameTap* tap) override { stream_.source().set_tap(tap); }
  [[nodiscard]] const CameraCounters& counters() const override { return stream_.counters(); }
  [[nodiscard]] std::size_t slots_bytes() const { return stream_.slots_bytes(); }

 private:
  FaultyStream<ColorCamera, std::uint8_t> stream_;
};

std::size_t pixels_count(const Intrinsics& camera) {
  return static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
}

}  // namespace

std::shared_ptr<const FaultCounts> inject(const FaultPlan& plan, Sensor& sensor, std::optional<rt::Clock> clock) {
  auto counts = std::make_shared<FaultCounts>();
  StreamSetup setup{plan, Stream::depth, sensor.is_live, pixels_count(sensor.calibration.depth), clock, counts};
  auto depth = std::make_unique<FaultyDepthCamera>(std::move(sensor.depth), setup);
  sensor.buffers_bytes += depth->slots_bytes() + setup.values_count * sizeof(std::uint16_t);
  sensor.depth = std::move(depth);
  if (sensor.color) {
    setup.stream = Stream::color;
    setup.values_count = pixels_count(sensor.calibration.color) * 3;
    auto color = std::make_unique<FaultyColorCamera>(std::move(sensor.color), setup);
    sensor.buffers_bytes += color->slots_bytes();
    sensor.color = std::move(color);
  }
  sensor.description += ", with faults injected";
  return counts;
}

}  // namespace tactus::hal::faults
