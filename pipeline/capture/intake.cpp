#include "pipeline/capture/intake.hpp"

#include <algorithm>

namespace tactus {
namespace {

constexpr std::int64_t kContradictionNs = 500'000'000;
constexpr std::int64_t kPauseNs = 1'000'000'000;

constexpr std::int64_t distance(std::int64_t a, std::int64_t b) { return a < b ? b - a : a - b; }

}  // namespace

void Intake::configure(double frame_rate_hz) noexcept {
  interval_ns_ = static_cast<std::int64_t>(1e9 / frame_rate_hz);
}

bool Intake::is_believable(const hal::FrameHeader& header, std::int64_t time_ns) const noexcept {
  if (time_ns <= last_time_ns_) return false;
  if (header.arrived.ns == 0 || last_arrived_.ns == 0) return true;
  return distance(time_ns - last_time_ns_, header.arrived.ns - last_arrived_.ns) <= kContradictionNs;
}

/// The time of a frame whose clock is not believed; `elapsed_ns` is what its number says has passed.
std::int64_t Intake::repair(std::int64_t raw_ns, std::int64_t expected_ns, std::int64_t elapsed_ns) noexcept {
  ++counts_.times_repaired;
  const bool stands_still = raw_ns == last_raw_ns_;
  const bool goes_on = has_suspect_ && distance(raw_ns - last_raw_ns_, elapsed_ns) <= interval_ns_ / 2;
  if (goes_on) {
    offset_ns_ = expected_ns - raw_ns;
    ++counts_.time_jumps;
  }
  has_suspect_ = !stands_still && !goes_on;
  return expected_ns;
}

rt::Status Intake::check(hal::FrameHeader& header) noexcept {
  const std::int64_t raw_ns = header.time.ns;
  if (has_last_) {
    if (header.sequence == last_sequence_) {
      ++counts_.duplicates;
      return rt::Status::stale;
    }
    if (header.sequence < last_sequence_ && last_sequence_ - header.sequence < kRenumberedMin) {
      ++counts_.out_of_order;
      return rt::Status::stale;
    }
    constexpr std::uint64_t kStepsMax = 1'000'000;  // nine hours; a number that leaps further says nothing
    const bool is_renumbered = header.sequence < last_sequence_;
    const std::uint64_t steps = is_renumbered ? 1 : std::min(header.sequence - last_sequence_, kStepsMax);
    counts_.gaps += steps - 1;
    const std::int64_t elapsed_ns = static_cast<std::int64_t>(steps) * interval_ns_;
    const std::int64_t expected_ns = last_time_ns_ + elapsed_ns;
    const std::int64_t time_ns = raw_ns + offset_ns_;
    if (is_believable(header, time_ns)) {
      has_suspect_ = false;
      if (time_ns - expected_ns >= kPauseNs) ++counts_.time_jumps;
      header.time.ns = time_ns;
    } else {
      header.time.ns = repair(raw_ns, expected_ns, elapsed_ns);
    }
  }
  has_last_ = true;
  last_sequence_ = header.sequence;
  last_time_ns_ = header.time.ns;
  last_raw_ns_ = raw_ns;
  last_arrived_ = header.arrived;
  return rt::Status::ok;
}

}  // namespace tactus
