#include "firmware_host/streams.hpp"

#include <optional>
#include <vector>

#include "rt/clock.hpp"

namespace tactus::firmware {
namespace {

constexpr rt::Duration kRecordingTimeout{1'000'000'000};
// With four buffers of a device at 100 Hz none of colour's is lost while depth is waited for.
constexpr rt::Duration kDeviceTimeout{20'000'000};
constexpr rt::Duration kBetweenCalls{10'000'000};  // to a device that is away

class Streams {
 public:
  Streams(hal::Sensor& sensor, const StreamsReader& reader, rt::Duration patience)
      : sensor_(sensor), reader_(reader), patience_(patience) {
    const hal::RigCalibration& rig = sensor.calibration;
    const auto pixels = [](const hal::Intrinsics& k) {
      return static_cast<std::size_t>(k.width) * static_cast<std::size_t>(k.height);
    };
    depth_.resize(pixels(rig.depth));
    if (sensor.color && !reader.skips_color) rgb_.resize(pixels(rig.color) * 3);
  }

  StreamsEnd read() {
    StreamsEnd end;
    end.color = sensor_.color ? rt::Status::ok : rt::Status::end_of_stream;
    while (!is_over()) {
      hal::FrameHeader header;
      const rt::Status status =
          sensor_.depth->read(depth_, header, sensor_.is_live ? kDeviceTimeout : kRecordingTimeout);
      if (status == rt::Status::ok) {
        last_frame_ = clock_.now();
        if (reader_.depth) reader_.depth(header, depth_);
        read_color_until(order_ns(header), {}, end.color);
        continue;
      }
      if (status == rt::Status::corrupt) continue;
      const bool may_come = sensor_.is_live && (status == rt::Status::timeout || status == rt::Status::device_lost);
      if (!may_come || clock_.now() - last_frame_ > patience_) {
        end.depth = status;
        break;
      }
      if (status == rt::Status::device_lost) clock_.sleep_until(clock_.now() + kBetweenCalls);
      read_color_until(std::nullopt, {}, end.color);
    }
    // What of colour belongs to the last depth frames.
    if (end.depth == rt::Status::end_of_stream) read_color_until(std::nullopt, kDeviceTimeout, end.color);
    return end;
  }

 private:
  [[nodiscard]] bool is_over() const { return reader_.is_over && reader_.is_over(); }
  [[nodiscard]] std::int64_t order_ns(const hal::FrameHeader& header) const {
    return sensor_.has_two_clocks && header.arrived.ns != 0 ? header.arrived.ns : header.time.ns;
  }

  /// Of a recording all up to that time; of a device all that is there within `timeout`.
  void read_color_until(std::optional<std::int64_t> until_ns, rt::Duration timeout, rt::Status& ended) {
    while (ended == rt::Status::ok) {
      hal::FrameHeader header;
      const rt::Status status = sensor_.color->peek(header, sensor_.is_live ? timeout : kRecordingTimeout);
      if (status == rt::Status::corrupt) continue;
      if (status != rt::Status::ok) {
        if (!sensor_.is_live || status == rt::Status::end_of_stream) ended = status;
        return;
      }
      if (!sensor_.is_live && until_ns && order_ns(header) > *until_ns) return;
      if (reader_.skips_color)
        sensor_.color->skip();
      else if (sensor_.color->read(rgb_, header, kRecordingTimeout) != rt::Status::ok)
        continue;
      if (reader_.color) reader_.color(header);
    }
  }

  hal::Sensor& sensor_;
  const StreamsReader& reader_;
  rt::Duration patience_;
  rt::Clock clock_ = rt::Clock::monotonic();
  rt::HostTime last_frame_ = clock_.now();
  std::vector<std::uint16_t> depth_;
  std::vector<std::uint8_t> rgb_;
};

}  // namespace

StreamsEnd read_streams(hal::Sensor& sensor, const StreamsReader& reader, rt::Duration patience) {
  return Streams(sensor, reader, patience).read();
}

}  // namespace tactus::firmware
