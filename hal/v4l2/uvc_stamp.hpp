// Bytes of UVC metadata and what they say of a frame's exposure: pure.
//
// A USB video camera stamps each payload with its own clock: PTS, when the capture of the frame began, and SCR, when the
// payload was sent. The driver adds when the host had it. Therefore, on the host's clock,
//   begin of capture = host time of the payload - (SCR - PTS) / clock rate
// up to the way of the payload to the host, which only makes it later: the earliest answer of a frame's payloads is best.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

namespace tactus::hal::v4l2 {

/// One payload header, as the driver's metadata node gives it (struct uvc_meta_buf).
struct UvcStamp {
  std::uint64_t host_ns = 0;    // when the driver had the payload
  std::uint16_t host_sof = 0;   // USB frame number then
  bool is_error = false;        // the device says that the payload is bad
  std::optional<std::uint32_t> pts;  // ticks of the device's clock
  std::optional<std::uint32_t> scr;  // ticks of the device's clock
  std::uint16_t device_sof = 0;      // USB frame number when it took scr
};

/// Takes the first block off `bytes`. Nothing: at the end, or when what is left is no whole block; then `bytes` is empty.
std::optional<UvcStamp> take_uvc_stamp(std::span<const std::uint8_t>& bytes);

/// Begin of the capture on the host's clock from all blocks of one frame. Nothing: no block has both stamps, or they are
/// more than a second apart.
std::optional<std::int64_t> capture_begin_ns(std::span<const std::uint8_t> metadata, std::uint32_t clock_hz);

/// dwClockFrequency of the video control interface with this number, from the device's raw descriptors. 0: not found.
std::uint32_t uvc_clock_hz(std::span<const std::uint8_t> descriptors, int control_interface);

/// A frame's time from the driver's stamp and, where there is one, the begin of its capture. A frame without keeps the
/// distance of the one before, so that times do not jump when metadata is late. Thread-bound. No heap.
class CaptureClock {
 public:
  std::int64_t at(std::int64_t driver_ns, std::optional<std::int64_t> begin_ns) {
    // Slow sensors expose and read out for up to a tenth of a second; 2 ms backwards is the host's own scheduling.
    constexpr std::int64_t kLatencyMinNs = -2'000'000, kLatencyMaxNs = 200'000'000;
    if (begin_ns) {
      const std::int64_t latency_ns = driver_ns - *begin_ns;
      if (latency_ns >= kLatencyMinNs && latency_ns <= kLatencyMaxNs) latency_ns_ = latency_ns;
    }
    return driver_ns - latency_ns_;
  }

 private:
  std::int64_t latency_ns_ = 0;
};

}  // namespace tactus::hal::v4l2
