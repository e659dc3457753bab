#include "hal/v4l2/uvc_stamp.hpp"

#include <algorithm>
#include <cstring>

namespace tactus::hal::v4l2 {
namespace {

constexpr std::size_t kDriverBytes = 10;  // host time and USB frame number, before the payload's own header
constexpr std::uint8_t kHasPts = 0x04, kHasScr = 0x08, kIsError = 0x40;

std::uint16_t little16(const std::uint8_t* bytes) { return static_cast<std::uint16_t>(bytes[0] | bytes[1] << 8); }
std::uint32_t little32(const std::uint8_t* bytes) {
  return static_cast<std::uint32_t>(little16(bytes)) | static_cast<std::uint32_t>(little16(bytes + 2)) << 16;
}

}  // namespace

std::optional<UvcStamp> take_uvc_stamp(std::span<const std::uint8_t>& bytes) {
  const std::span<const std::uint8_t> from = bytes;
  bytes = {};
  if (from.size() < kDriverBytes + 2) return std::nullopt;
  const std::size_t header_bytes = from[kDriverBytes];
  if (header_bytes < 2 || from.size() < kDriverBytes + header_bytes) return std::nullopt;
  UvcStamp stamp;
  // The driver's two are in the byte order of this machine.
  std::memcpy(&stamp.host_ns, from.data(), sizeof stamp.host_ns);
  std::memcpy(&stamp.host_sof, from.data() + 8, sizeof stamp.host_sof);
  const std::uint8_t flags = from[kDriverBytes + 1];
  stamp.is_error = (flags & kIsError) != 0;
  std::span<const std::uint8_t> rest = from.subspan(kDriverBytes + 2, header_bytes - 2);
  if ((flags & kHasPts) != 0 && rest.size() >= 4) {
    stamp.pts = little32(rest.data());
    rest = rest.subspan(4);
  }
  if ((flags & kHasScr) != 0 && rest.size() >= 6) {
    stamp.scr = little32(rest.data());
    stamp.device_sof = static_cast<std::uint16_t>(little16(rest.data() + 4) & 0x7ff);
  }
  bytes = from.subspan(kDriverBytes + header_bytes);
  return stamp;
}

std::optional<std::int64_t> capture_begin_ns(std::span<const std::uint8_t> metadata, std::uint32_t clock_hz) {
  if (clock_hz == 0) return std::nullopt;
  std::optional<std::int64_t> earliest;
  while (const auto stamp = take_uvc_stamp(metadata)) {
    if (stamp->is_error || !stamp->pts || !stamp->scr) continue;
    const std::uint32_t ticks = *stamp->scr - *stamp->pts;
    if (ticks > clock_hz) continue;  // also PTS after SCR: the difference wraps
    constexpr std::uint64_t kHostMaxNs = std::uint64_t{1} << 62;
    if (stamp->host_ns > kHostMaxNs) continue;
    const auto begin_ns = static_cast<std::int64_t>(stamp->host_ns) -
                          static_cast<std::int64_t>(std::uint64_t{ticks} * 1'000'000'000U / clock_hz);
    earliest = std::min(earliest.value_or(begin_ns), begin_ns);
  }
  return earliest;
}

std::uint32_t uvc_clock_hz(std::span<const std::uint8_t> descriptors, int control_interface) {
  constexpr std::uint8_t kInterface = 4, kClassSpecific = 0x24, kHeader = 1, kVideo = 14, kControl = 1;
  bool is_inside = false;
  while (descriptors.size() >= 2 && descriptors[0] >= 2 && descriptors[0] <= descriptors.size()) {
    const std::span<const std::uint8_t> one = descriptors.first(descriptors[0]);
    descriptors = descriptors.subspan(one.size());
    if (one.size() >= 9 && one[1] == kInterface)
      is_inside = one[2] == control_interface && one[5] == kVideo && one[6] == kControl;
    if (is_inside && one.size() >= 12 && one[1] == kClassSpecific && one[2] == kHeader) return little32(one.data() + 7);
  }
  return 0;
}

}  // namespace tactus::hal::v4l2
