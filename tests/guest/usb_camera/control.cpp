#include "tests/guest/usb_camera/control.hpp"

#include <algorithm>
#include <cstdlib>
#include <utility>

namespace tactus::guest {
namespace {

// bmRequestType: direction, kind, recipient.
constexpr std::uint8_t kIn = 0x80, kToEndpoint = 0x02, kClassToInterface = 0x21;
// Standard requests (USB 2.0 table 9-4).
constexpr std::uint8_t kGetStatus = 0, kClearFeature = 1, kGetDescriptor = 6, kSetConfiguration = 9, kSetInterface = 11;
// UVC's (UVC 1.0 table A-8), and its selectors.
constexpr std::uint8_t kSetCurrent = 0x01, kGetCurrent = 0x81, kGetMin = 0x82, kGetMax = 0x83,
                       kGetResolution = 0x84, kGetLength = 0x85, kGetInfo = 0x86, kGetDefault = 0x87;
constexpr std::uint8_t kProbe = 1, kCommit = 2, kBrightness = 2;
constexpr std::int16_t kBrightnessMax = 64;
constexpr std::size_t kProbeBytes = 26, kIntervalAt = 4, kFrameSizeAt = 18, kPayloadSizeAt = 22;

std::uint32_t get_u32(std::span<const std::uint8_t> bytes, std::size_t at) {
  return bytes[at] | static_cast<std::uint32_t>(bytes[at + 1]) << 8 | static_cast<std::uint32_t>(bytes[at + 2]) << 16 |
         static_cast<std::uint32_t>(bytes[at + 3]) << 24;
}

void put_u32(Bytes& bytes, std::size_t at, std::uint32_t value) {
  for (std::size_t i = 0; i < 4; ++i) bytes[at + i] = static_cast<std::uint8_t>(value >> 8 * i);
}

// The interval on offer that is nearest to what was asked for; 0 asks for the default.
std::uint32_t nearest(const std::vector<std::uint32_t>& offered, std::uint32_t asked) {
  if (asked == 0) return offered.front();
  const auto distance = [&](std::uint32_t interval) {
    return std::abs(static_cast<std::int64_t>(interval) - static_cast<std::int64_t>(asked));
  };
  return *std::min_element(offered.begin(), offered.end(),
                           [&](std::uint32_t a, std::uint32_t b) { return distance(a) < distance(b); });
}

}  // namespace

Control::Control(const CameraSpec& camera)
    : camera_(camera),
      settings_(camera.streams.size(), {camera.frame_intervals.front(), camera.frame_intervals.front(), 0}) {}

std::optional<Bytes> Control::answer(std::span<const std::uint8_t, 8> setup, std::span<const std::uint8_t> data) {
  const auto u16 = [&](std::size_t at) { return static_cast<std::uint16_t>(setup[at] | setup[at + 1] << 8); };
  const std::uint8_t type = setup[0], request = setup[1];
  const std::uint16_t value = u16(2), index = u16(4), length = u16(6);
  std::optional<Bytes> answer;
  if ((type & ~kIn) == kClassToInterface) {
    const auto interface = static_cast<std::uint8_t>(index & 255), entity = static_cast<std::uint8_t>(index >> 8);
    const auto selector = static_cast<std::uint8_t>(value >> 8);
    if (entity == 0 && interface >= 1 && interface <= camera_.streams.size())
      answer = streaming(request, selector, interface - std::size_t{1}, data);
    for (std::size_t i = 0; i < camera_.streams.size(); ++i)
      if (interface == 0 && entity == processing_unit_of(i) && selector == kBrightness &&
          camera_.streams[i].format == hal::PixelFormat::yuyv)
        answer = brightness(request, i, data);
  } else {
    answer = standard(type, request, value, index);
  }
  if (answer && answer->size() > length) answer->resize(length);
  return answer;
}

std::optional<std::size_t> Control::take_committed() { return std::exchange(committed_, std::nullopt); }
std::optional<std::size_t> Control::take_stopped() { return std::exchange(stopped_, std::nullopt); }

std::optional<Bytes> Control::standard(std::uint8_t type, std::uint8_t request, std::uint16_t value,
                                       std::uint16_t index) {
  switch (request) {
    case kGetDescriptor:
      return type == kIn ? descriptor(value) : std::nullopt;
    case kGetStatus:
      return Bytes{0, 0};
    case kClearFeature:
      if (type == kToEndpoint)
        for (std::size_t i = 0; i < camera_.streams.size(); ++i)
          if ((index & 127) == endpoint_of(i)) stopped_ = i;
      return Bytes{};
    case kSetConfiguration:
    case kSetInterface:
      return Bytes{};
    default:
      return std::nullopt;
  }
}

std::optional<Bytes> Control::descriptor(std::uint16_t value) const {
  Bytes bytes;
  switch (value >> 8) {
    case 1:
      bytes = device_descriptor();
      break;
    case 2:
      bytes = configuration_descriptor(camera_);
      break;
    case 3:
      bytes = string_descriptor(camera_, static_cast<std::uint8_t>(value & 255));
      break;
    default:
      break;
  }
  if (bytes.empty()) return std::nullopt;
  return bytes;
}

std::optional<Bytes> Control::streaming(std::uint8_t request, std::uint8_t selector, std::size_t stream,
                                        std::span<const std::uint8_t> data) {
  if (selector != kProbe && selector != kCommit) return std::nullopt;
  Settings& settings = settings_[stream];
  switch (request) {
    case kSetCurrent:
      if (data.size() < kProbeBytes) return std::nullopt;
      settings.probed = nearest(camera_.frame_intervals, get_u32(data, kIntervalAt));
      if (selector == kCommit) {
        settings.committed = settings.probed;
        committed_ = stream;
      }
      return Bytes{};
    case kGetCurrent:
      return probe_block(stream, selector == kCommit ? settings.committed : settings.probed);
    case kGetDefault:
      return probe_block(stream, camera_.frame_intervals.front());
    case kGetMin:
      return probe_block(stream, *std::min_element(camera_.frame_intervals.begin(), camera_.frame_intervals.end()));
    case kGetMax:
      return probe_block(stream, *std::max_element(camera_.frame_intervals.begin(), camera_.frame_intervals.end()));
    case kGetLength:
      return Bytes{kProbeBytes, 0};
    case kGetInfo:
      return Bytes{3};  // may be read and set
    default:
      return std::nullopt;
  }
}

std::optional<Bytes> Control::brightness(std::uint8_t request, std::size_t stream, std::span<const std::uint8_t> data) {
  const auto word = [](int value) {
    return Bytes{static_cast<std::uint8_t>(value & 255), static_cast<std::uint8_t>(value >> 8 & 255)};
  };
  switch (request) {
    case kSetCurrent: {
      if (data.size() != 2) return std::nullopt;
      const auto value = static_cast<std::int16_t>(data[0] | data[1] << 8);
      if (value < -kBrightnessMax || value > kBrightnessMax) return std::nullopt;
      settings_[stream].brightness = value;
      return Bytes{};
    }
    case kGetCurrent:
      return word(settings_[stream].brightness);
    case kGetMin:
      return word(-kBrightnessMax);
    case kGetMax:
      return word(kBrightnessMax);
    case kGetResolution:
      return word(1);
    case kGetDefault:
      return word(0);
    case kGetLength:
      return word(2);
    case kGetInfo:
      return Bytes{3};
    default:
      return std::nullopt;
  }
}

Bytes Control::probe_block(std::size_t stream, std::uint32_t frame_interval) const {
  Bytes block(kProbeBytes);
  block[0] = 1;  // the interval is kept as it is
  block[2] = 1;  // the one format
  block[3] = 1;  // and its one frame size
  put_u32(block, kIntervalAt, frame_interval);
  put_u32(block, kFrameSizeAt, camera_.streams[stream].frame_bytes());
  put_u32(block, kPayloadSizeAt, kPayloadBytes);
  return block;
}

}  // namespace tactus::guest
