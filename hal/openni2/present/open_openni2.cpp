#include <algorithm>
#include <type_traits>

#include "hal/frames/convert.hpp"
#include "hal/frames/frame_outcome.hpp"
#include "hal/openni2/openni2.hpp"
#include "hal/openni2/present/live_device.hpp"
#include "hal/openni2/present/modes.hpp"
#include "rt/clock.hpp"
#include "rt/heap_guard.hpp"

namespace tactus::hal::openni2 {
namespace {

/// Pixel is uint16 (depth) or uint8 (colour).
template <typename CameraKind, typename Pixel>
class OpenNi2Camera : public CameraKind {
 public:
  OpenNi2Camera(std::shared_ptr<LiveDevice> device, const LiveStream& stream)
      : device_(std::move(device)), stream_(stream), intake_(*stream.intake) {
    counters_.first_rejection.reserve(frames::kSentenceBytes);
  }

  rt::Status read(std::span<Pixel> pixels, FrameHeader& header, rt::Duration timeout) override {
    FrameHeader announced;
    rt::Status status = announce(announced, timeout);
    if (status != rt::Status::ok) return status;
    const RawFrame raw = raw_front();
    status = convert(raw, pixels);
    if (status == rt::Status::ok) {
      ++counters_.frames_delivered;
      header = announced;
      if (this->tap_ != nullptr) this->tap_->take(kStream, raw);
    } else {
      reject("a JPEG of the device cannot be decoded");
    }
    intake_.done();
    return status;
  }
  [[nodiscard]] const CameraCounters& counters() const override { return counters_; }

 protected:
  static constexpr bool kIsDepth = std::is_same_v<Pixel, std::uint16_t>;
  static constexpr Stream kStream = kIsDepth ? Stream::depth : Stream::color;

  /// Waits for a frame and leaves it in front; one that is no good is counted and given back.
  rt::Status announce(FrameHeader& header, rt::Duration timeout) {
    const rt::Clock clock = rt::Clock::monotonic();
    const rt::HostTime end = clock.now() + timeout;
    for (rt::Duration left = timeout;; left = std::max(rt::Duration{0}, end - clock.now())) {
      const bool is_known = intake_.has_front();
      if (!has_last_ && !is_known) intake_.pass_over_old();
      const rt::Status status = intake_.await(left);
      counters_.losses = intake_.losses();
      if (status != rt::Status::ok) return status;
      header = intake_.front().header;
      if (is_known) return rt::Status::ok;
      if (has_last_) counters_.frames_missing += header.sequence - last_.sequence - 1;
      const bool is_later = !has_last_ || header.time > last_.time;
      last_ = {is_later ? header.time : last_.time, header.sequence, header.arrived};
      has_last_ = true;
      if (!is_later) {
        ++counters_.timestamps_rejected;
        say("a frame's time was not later than the time of the one before");
        intake_.done();
        continue;
      }
      if (is_as_agreed()) return rt::Status::ok;
      reject("a frame came short, or in another size or format than was agreed");
      intake_.done();
      return rt::Status::corrupt;
    }
  }

  [[nodiscard]] RawFrame raw_front() const {
    const OniFrame& frame = *intake_.front().frame;
    return {intake_.front().header,
            stream_.format,
            frame.width,
            frame.height,
            stream_.format == PixelFormat::mjpeg ? 0 : static_cast<std::size_t>(frame.stride),
            {static_cast<const std::uint8_t*>(frame.data), static_cast<std::size_t>(frame.dataSize)}};
  }

  std::shared_ptr<LiveDevice> device_;
  const LiveStream& stream_;
  StreamIntake& intake_;
  CameraCounters counters_;

 private:
  [[nodiscard]] bool is_as_agreed() const {
    const OniFrame& frame = *intake_.front().frame;
    return frame.videoMode.pixelFormat == stream_.mode.pixelFormat && frame.width == stream_.mode.resolutionX &&
           frame.height == stream_.mode.resolutionY && frame.dataSize > 0 && frame.stride >= 0 && frame.data != nullptr &&
           frames::is_whole(raw_front());
  }

  rt::Status convert(const RawFrame& raw, std::span<Pixel> pixels) const {
    if constexpr (kIsDepth) {
      return frames::to_depth(raw, pixels);
    } else {
      if (raw.format != PixelFormat::mjpeg) return frames::to_rgb(raw, pixels);
      const rt::GuestScope libjpeg;
      return frames::to_rgb(raw, pixels);
    }
  }

  void say(const char* sentence) {
    if (counters_.first_rejection.empty()) counters_.first_rejection.assign(sentence);
  }
  void reject(const char* sentence) {
    ++counters_.frames_rejected;
    say(sentence);
  }

  FrameHeader last_;
  bool has_last_ = false;
};

using OpenNi2Depth = OpenNi2Camera<DepthCamera, std::uint16_t>;

class OpenNi2Color final : public OpenNi2Camera<ColorCamera, std::uint8_t> {
 public:
  using OpenNi2Camera::OpenNi2Camera;
  rt::Status peek(FrameHeader& header, rt::Duration timeout) override { return announce(header, timeout); }
  void skip() override {
    if (!intake_.has_front()) return;
    ++counters_.frames_delivered;
    if (tap_ != nullptr) tap_->take(Stream::color, raw_front());
    intake_.done();
  }
};

}  // namespace

rt::Result<Sensor> open_openni2(const OpenNi2Request& request) {
  auto opened = LiveDevice::open(request);
  if (!opened) return opened.error();
  const std::shared_ptr<LiveDevice>& device = *opened;
  const OniDeviceInfo& info = device->info();
  const std::string source = std::string("openni2:") + info.uri;
  Sensor sensor;
  sensor.is_live = true;
  sensor.frame_rate_hz = device->depth.mode.fps > 0 ? device->depth.mode.fps : 30;
  sensor.calibration.depth_m_per_unit =
      device->depth.mode.pixelFormat == ONI_PIXEL_FORMAT_DEPTH_100_UM ? 0.0001 : 0.001;
  std::optional<SeenFrom> color_seen;
  if (device->color) color_seen = device->color->seen;
  assume_calibration(device->depth.seen, color_seen, device->is_registered(), source, sensor.calibration, sensor.notes);
  sensor.description = std::string("OpenNI2 ") + info.vendor + " " + info.name + " (" + info.uri + "), " +
                       to_string(device->depth.mode) +
                       (device->color ? ", " + to_string(device->color->mode) : std::string(", depth only")) +
                       (sensor.calibration.registered ? ", registered" : "") +
                       (device->is_synced() ? ", both exposed together" : "");
  sensor.depth = std::make_unique<OpenNi2Depth>(device, device->depth);
  sensor.buffers_bytes = device->depth.intake->buffers().bytes();
  if (device->color) {
    sensor.color = std::make_unique<OpenNi2Color>(device, *device->color);
    sensor.buffers_bytes += device->color->intake->buffers().bytes();
  }
  return sensor;
}

}  // namespace tactus::hal::openni2
