// Who has not been heard of for too long.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "rt/assert.hpp"
#include "rt/static_vector.hpp"
#include "rt/time.hpp"

namespace tactus::rt {

/// Each thread checks in at every round; somebody polls and is told who is late. It only observes: what to do
/// about it is the caller's decision. A thread is watched from its first check-in until it says goodbye.
class Watchdog {
 public:
  static constexpr std::size_t kThreadsMax = 16;

  struct Late {
    const char* name = "";
    Duration silent_for;
  };

  /// Answers the thread's index for check_in(). Boot, one thread.
  std::size_t add(const char* name, Duration silence_max) {
    TACTUS_ASSERT(threads_count_ < kThreadsMax && silence_max.ns > 0);
    threads_[threads_count_].name = name;
    threads_[threads_count_].silence_max = silence_max;
    return threads_count_++;
  }

  /// Step, the watched thread, wait-free. Relaxed: the time is the whole message.
  void check_in(std::size_t thread_index, HostTime now) noexcept { store(thread_index, now.ns); }
  void say_goodbye(std::size_t thread_index) noexcept { store(thread_index, kUnwatched); }

  /// Who is late at `now`. Any thread, wait-free. Relaxed: a check-in not yet seen is at worst a false alarm
  /// of the few hundred nanoseconds that it takes to arrive.
  [[nodiscard]] StaticVector<Late, kThreadsMax> poll(HostTime now) const noexcept {
    StaticVector<Late, kThreadsMax> late;
    for (std::size_t i = 0; i < threads_count_; ++i) {
      const std::int64_t heard_ns = threads_[i].heard_ns.load(std::memory_order_relaxed);
      if (heard_ns == kUnwatched) continue;
      const Duration silent_for{now.ns - heard_ns};
      if (silent_for > threads_[i].silence_max) late.push_back({threads_[i].name, silent_for});
    }
    return late;
  }

 private:
  static constexpr std::int64_t kUnwatched = std::numeric_limits<std::int64_t>::min();
  struct Thread {
    const char* name = "";
    Duration silence_max;
    std::atomic<std::int64_t> heard_ns{kUnwatched};
  };
  void store(std::size_t thread_index, std::int64_t ns) noexcept {
    TACTUS_ASSERT(thread_index < threads_count_);
    threads_[thread_index].heard_ns.store(ns, std::memory_order_relaxed);
  }

  std::array<Thread, kThreadsMax> threads_;
  std::size_t threads_count_ = 0;
};

}  // namespace tactus::rt
