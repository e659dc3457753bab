#include "rt/clock.hpp"

#include <time.h>

#include <cerrno>

#include "rt/assert.hpp"

namespace tactus::rt {
namespace {

constexpr std::int64_t kNsPerSecond = 1'000'000'000;

}  // namespace

HostTime Clock::now() const noexcept {
  if (manual_ != nullptr) return manual_->now();
  timespec t{};
  TACTUS_ASSERT(clock_gettime(CLOCK_MONOTONIC, &t) == 0);
  return {static_cast<std::int64_t>(t.tv_sec) * kNsPerSecond + t.tv_nsec};
}

void Clock::sleep_until(HostTime when) const noexcept {
  if (manual_ != nullptr) {
    if (manual_->now() < when) manual_->set(when);
    return;
  }
  if (when.ns <= 0) return;
  timespec t{};
  t.tv_sec = static_cast<time_t>(when.ns / kNsPerSecond);
  t.tv_nsec = static_cast<long>(when.ns % kNsPerSecond);
  // Absolute, so that a signal does not stretch the wait: a sleep that was interrupted simply goes on.
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr) == EINTR) {
  }
}

}  // namespace tactus::rt
