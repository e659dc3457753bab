// Two clocks beside each other: what passed on the wall, and what this thread was given of the processor.
#pragma once

#include <time.h>

#include <cstdint>

namespace tactus::firmware {

/// On a machine that others use too, wall time holds their work; CPU time does not (it still holds what their
/// work costs this thread in shared caches and memory).
struct BenchInstant {
  std::int64_t wall_ns = 0, cpu_ns = 0;

  /// Of the calling thread; some 200 ns, since CPU time is a system call.
  static BenchInstant now() noexcept {
    return {nanoseconds_of(CLOCK_MONOTONIC), nanoseconds_of(CLOCK_THREAD_CPUTIME_ID)};
  }

 private:
  static std::int64_t nanoseconds_of(clockid_t clock) noexcept {
    timespec t{};
    clock_gettime(clock, &t);
    return std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec;
  }
};

}  // namespace tactus::firmware
