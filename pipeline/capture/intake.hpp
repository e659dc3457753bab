// What a camera's frames are checked for before the pipeline believes their numbers and times. A device may repeat a
// frame, deliver two in the wrong order, leave some out, or have a clock that stands still or leaps.
#pragma once

#include <cstdint>

#include "hal/camera.hpp"
#include "rt/status.hpp"

namespace tactus {

struct IntakeCounts {
  std::uint64_t duplicates = 0;      // of the frame before; rejected
  std::uint64_t out_of_order = 0;    // numbered before one that was taken already; rejected
  std::uint64_t gaps = 0;            // numbers that never came, frames that the camera itself rejected among them
  std::uint64_t times_repaired = 0;  // the clock stood still or leapt: the frame got the time its number says
  std::uint64_t time_jumps = 0;      // leaps of the clock that stayed, and pauses of a second or more

  [[nodiscard]] std::uint64_t rejected() const noexcept { return duplicates + out_of_order; }
};

class Intake {
 public:
  /// Boot. The nominal interval of the camera's frames.
  void configure(double frame_rate_hz) noexcept;

  /// ok: the frame is taken, and header.time is later than that of the one before. stale: it is to be thrown away.
  ///
  /// A time that is not later than the last although the number is, or that has moved by half a second more or less than
  /// the host's clock while both are known, is the clock's fault: the frame gets the last time plus its number's share of
  /// the nominal interval. When a second frame says the same, the clock has leapt: its offset is taken out from there on,
  /// so that tracking sees no jump and colour stays beside its depth. Step; one thread; nothing but arithmetic.
  rt::Status check(hal::FrameHeader& header) noexcept;

  [[nodiscard]] const IntakeCounts& counts() const noexcept { return counts_; }

 private:
  static constexpr std::uint64_t kRenumberedMin = 64;  // further back is a device that began to count anew

  [[nodiscard]] bool is_believable(const hal::FrameHeader& header, std::int64_t time_ns) const noexcept;
  std::int64_t repair(std::int64_t raw_ns, std::int64_t expected_ns, std::int64_t elapsed_ns) noexcept;

  std::int64_t interval_ns_ = 33'333'333;
  bool has_last_ = false;
  std::uint64_t last_sequence_ = 0;
  std::int64_t last_time_ns_ = 0;  // as handed on
  std::int64_t last_raw_ns_ = 0;   // as the device said
  rt::HostTime last_arrived_;
  std::int64_t offset_ns_ = 0;     // of all leaps so far
  bool has_suspect_ = false;       // the frame before had a time that could be a leap's first
  IntakeCounts counts_;
};

}  // namespace tactus
