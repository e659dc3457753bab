// When a stage runs, and what is written down about it. Stages own no thread and read no clock: this does.
//
// Realtime: each thread runs run_periodic() (or its own loop on an edge) and calls run_stage() for each of
// its stages. Lockstep: one thread calls run_stage() for every stage in a fixed order with kNoDeadline;
// nothing else differs.
#pragma once

#include <atomic>
#include <cstdint>
#include <limits>
#include <utility>

#include "rt/assert.hpp"
#include "rt/clock.hpp"
#include "rt/counters.hpp"
#include "rt/heap_guard.hpp"
#include "rt/histogram.hpp"
#include "rt/status.hpp"
#include "rt/time.hpp"
#include "rt/trace.hpp"

namespace tactus::rt {

inline constexpr HostTime kNoDeadline{std::numeric_limits<std::int64_t>::max()};

/// What a step is told. Exists only during the step.
struct StageContext {
  HostTime now;  ///< when the step began
  HostTime deadline = kNoDeadline;
  TraceRing* trace = nullptr;  ///< the thread's; may be null

  [[nodiscard]] bool is_late() const { return now > deadline; }
  void trace_counter(const char* name, std::int64_t value) const noexcept {
    if (trace != nullptr) trace->counter(name, now, value);
  }
};

/// Does a stage that comes after its deadline run all the same (pose, display) or give way?
enum class WhenLate : std::uint8_t { run, skip };

/// What is written down about a stage. Written by the one thread that runs the stage, read when that thread
/// rests (statuses at any time).
struct StageRecord {
  explicit StageRecord(const char* stage_name, WhenLate policy = WhenLate::run)
      : name(stage_name), when_late(policy) {}

  const char* name;
  WhenLate when_late;
  Histogram latency;               ///< of the steps that ran
  StatusCounters statuses;         ///< of all
  std::uint64_t missed_count = 0;  ///< steps that began in time and ended after the deadline
};

/// Runs one step: `step(const StageContext&) noexcept -> Status`. Times it, counts its answer, traces it
/// (with the answer as value). Late and told to skip: answers Status::late at once, without running it. Step,
/// the stage's thread.
template <typename Step>
Status run_stage(StageRecord& record, Clock clock, HostTime deadline, TraceRing* trace,
                 Step&& step) noexcept {
  const StageContext context{clock.now(), deadline, trace};
  if (context.is_late() && record.when_late == WhenLate::skip) {
    record.statuses.count(Status::late);
    if (trace != nullptr) trace->instant(record.name, context.now, static_cast<std::int64_t>(Status::late));
    return Status::late;
  }
  const Status status = [&] {
    const RtScope scope;  // here too, so that the lockstep runner counts heap calls like the realtime one
    return std::forward<Step>(step)(context);
  }();
  const HostTime end = clock.now();
  record.latency.record(end - context.now);
  record.statuses.count(status);
  if (!context.is_late() && end > deadline) ++record.missed_count;
  if (trace != nullptr) {
    trace->span(record.name, context.now, end - context.now, static_cast<std::int64_t>(status));
  }
  return status;
}

/// When a periodic thread wakes next. Late means skip, never catch up: a round that ends after the next one
/// should have begun loses that one and all others it ran into, and the next begins a whole period from now.
/// So a thread that was held up never runs back to back and does not take from the others the time that it
/// lost itself.
class Cadence {
 public:
  Cadence(Duration period, HostTime first) : period_(period), next_(first) { TACTUS_ASSERT(period.ns > 0); }

  [[nodiscard]] HostTime next() const { return next_; }
  [[nodiscard]] Duration period() const { return period_; }
  /// Rounds that did not take place.
  [[nodiscard]] std::uint64_t slipped_count() const { return slipped_count_; }

  /// To be called when a round has ended, with the time; answers how many rounds slipped (usually 0).
  std::uint64_t arm(HostTime now) noexcept {
    next_ = next_ + period_;
    if (now <= next_) return 0;
    const auto slipped = static_cast<std::uint64_t>((now - next_).ns / period_.ns) + 1;
    next_ = now + period_;
    slipped_count_ += slipped;
    return slipped;
  }

 private:
  Duration period_;
  HostTime next_;
  std::uint64_t slipped_count_ = 0;
};

/// The loop of a periodic thread: sleeps until the cadence says, runs `round(now, deadline)` inside an
/// RtScope, until `is_stopping`. A round's deadline is the moment the next one is due. On a manual clock it
/// runs without waiting.
template <typename Round>
void run_periodic(Cadence& cadence, Clock clock, const std::atomic<bool>& is_stopping,
                  Round&& round) noexcept {
  const RtScope scope;
  // Acquire pairs with the release of whoever asks to stop: what was done before asking is seen after the
  // loop.
  while (!is_stopping.load(std::memory_order_acquire)) {
    clock.sleep_until(cadence.next());
    round(clock.now(), cadence.next() + cadence.period());
    cadence.arm(clock.now());
  }
}

}  // namespace tactus::rt
