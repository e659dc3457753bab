// The clocks: every component is handed the time or a Clock; nobody else asks the system.
#pragma once

#include <atomic>

#include "rt/time.hpp"

namespace tactus::rt {

/// Time that moves only when told to: tests and the lockstep runner. Any thread; wait-free.
class ManualClock {
 public:
  explicit ManualClock(HostTime start = {}) : now_ns_(start.ns) {}
  [[nodiscard]] HostTime now() const noexcept { return {now_ns_.load(std::memory_order_relaxed)}; }
  void set(HostTime now) noexcept { now_ns_.store(now.ns, std::memory_order_relaxed); }
  void advance(Duration by) noexcept { now_ns_.fetch_add(by.ns, std::memory_order_relaxed); }

 private:
  // Relaxed: the time is a value of its own and publishes nothing else.
  std::atomic<std::int64_t> now_ns_;
};

/// Which clock to ask, as a value to be passed by argument (one pointer). Any phase, any thread.
class Clock {
 public:
  /// CLOCK_MONOTONIC of the system: never set back, same clock in every process of this boot.
  static Clock monotonic() noexcept { return Clock(nullptr); }
  /// `manual` must outlive every copy of the answer.
  static Clock manual(ManualClock& manual) noexcept { return Clock(&manual); }

  /// Wait-free; tens of nanoseconds (vDSO).
  [[nodiscard]] HostTime now() const noexcept;

  /// Returns at `when` or soon after, at once when it has passed. May wait, that is its purpose. On a manual
  /// clock nobody waits: the clock moves to `when`.
  void sleep_until(HostTime when) const noexcept;

 private:
  explicit Clock(ManualClock* manual) noexcept : manual_(manual) {}
  ManualClock* manual_;
};

}  // namespace tactus::rt
