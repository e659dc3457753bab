#include "firmware_host/run_session.hpp"

#include <csignal>
#include <cstdio>
#include <optional>

#include "firmware_host/progress.hpp"
#include "hal/display.hpp"
#include "rt/heap_guard.hpp"
#include "rt/thread.hpp"

namespace tactus::firmware {
namespace {

constexpr rt::Duration kContactPeriod{16'666'667};  // two physics steps
constexpr rt::Duration kIdle{500'000};              // between looks into an empty ring
constexpr rt::Duration kPatience{30'000'000'000};   // for a device that went away: time to find the plug
constexpr rt::Duration kBetweenCalls{10'000'000};   // to a device that is away

/// Whether the source is over: at its end, or away for longer than anyone waits.
class SourceWatch {
 public:
  explicit SourceWatch(rt::Clock clock) : clock_(clock) {}

  /// To be told what each capture round said. Sleeps a little while a device is away.
  bool is_over(rt::Status captured) {
    if (captured == rt::Status::end_of_stream) return true;
    if (captured != rt::Status::device_lost) {
      away_since_.reset();
      return false;
    }
    const rt::HostTime now = clock_.now();
    if (!away_since_) away_since_ = now;
    if (now - *away_since_ > kPatience) return true;
    clock_.sleep_until(now + kBetweenCalls);
    return false;
  }

 private:
  rt::Clock clock_;
  std::optional<rt::HostTime> away_since_;
};

extern "C" void on_signal(int) { interrupted.store(true, std::memory_order_relaxed); }

}  // namespace

std::atomic<bool> interrupted{false};

void catch_signals() {
  interrupted.store(false, std::memory_order_relaxed);
  struct sigaction action {};
  action.sa_handler = SIG_IGN;
  sigaction(SIGXFSZ, &action, nullptr);
  action.sa_handler = on_signal;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

double run_lockstep(Pipeline& pipeline, double frame_rate_hz, std::uint64_t frames_expected, Presenter& presenter,
                    Recorder* recorder) {
  const rt::Clock clock = rt::Clock::monotonic();
  const rt::Duration frame_time{static_cast<std::int64_t>(1e9 / frame_rate_hz)};
  Progress progress("lockstep", frames_expected, clock);
  const rt::HostTime begin = clock.now();
  std::uint64_t frame = 0;
  SourceWatch watch(clock);
  while (!interrupted.load(std::memory_order_relaxed)) {
    const rt::Status captured = pipeline.capture_round(clock);
    if (watch.is_over(captured)) break;
    if (captured != rt::Status::ok) continue;  // rejected and counted
    (void)pipeline.spine_round(clock, rt::kNoDeadline);
    (void)pipeline.segment_round(clock);
    (void)pipeline.refine_round(clock);
    presenter.begin_round(pipeline);
    (void)pipeline.contact_round(clock, frame_time);
    presenter.end_round(pipeline, clock, frame);
    if (recorder != nullptr) (void)recorder->round(pipeline, clock);
    if (presenter.wants_to_end()) interrupted.store(true);
    progress.update(++frame);
  }
  return (clock.now() - begin).seconds();
}

namespace {

struct Realtime {
  Pipeline* pipeline = nullptr;
  Presenter* presenter = nullptr;
  Recorder* recorder = nullptr;
  rt::Clock clock = rt::Clock::monotonic();
  rt::Duration frame_time{};
  bool is_live = false;
  std::atomic<bool> capture_is_over{false}, spine_is_over{false};
  std::atomic<std::uint64_t> frames_done{0};
};

void capture_main(void* context) {
  auto& run = *static_cast<Realtime*>(context);
  // A recording's frame is due when as much time has passed here as did for the sensor.
  rt::HostTime due = run.clock.now();
  SourceWatch watch(run.clock);
  while (!interrupted.load(std::memory_order_relaxed)) {
    const rt::Status captured = run.pipeline->capture_round(run.clock);
    if (watch.is_over(captured)) break;
    if (run.is_live) continue;
    due = due + run.frame_time;
    run.clock.sleep_until(due);
  }
  // Release pairs with the acquire in spine_main: the last frame was pushed before.
  run.capture_is_over.store(true, std::memory_order_release);
}

void spine_main(void* context) {
  auto& run = *static_cast<Realtime*>(context);
  for (;;) {
    const bool is_last_look = run.capture_is_over.load(std::memory_order_acquire);
    const rt::Status status = run.pipeline->spine_round(run.clock, run.clock.now() + kFrameBudget);
    if (status != rt::Status::skipped) {
      run.frames_done.fetch_add(1, std::memory_order_relaxed);  // a number for the progress line only
      continue;
    }
    if (is_last_look) break;
    run.clock.sleep_until(run.clock.now() + kIdle);
  }
  run.spine_is_over.store(true, std::memory_order_release);
}

void segment_main(void* context) {
  auto& run = *static_cast<Realtime*>(context);
  while (!run.spine_is_over.load(std::memory_order_acquire))
    if (run.pipeline->segment_round(run.clock) == rt::Status::skipped)
      run.clock.sleep_until(run.clock.now() + rt::Duration{2'000'000});
}

void refine_main(void* context) {
  auto& run = *static_cast<Realtime*>(context);
  while (!run.spine_is_over.load(std::memory_order_acquire)) {
    (void)run.pipeline->refine_round(run.clock);
    run.clock.sleep_until(run.clock.now() + rt::Duration{5'000'000});
  }
}

void present_main(void* context) {
  auto& run = *static_cast<Realtime*>(context);
  rt::Cadence cadence(kContactPeriod, run.clock.now());
  while (!run.spine_is_over.load(std::memory_order_acquire)) {
    run.clock.sleep_until(cadence.next());
    run.presenter->begin_round(*run.pipeline);
    (void)run.pipeline->contact_round(run.clock, kContactPeriod);
    run.presenter->end_round(*run.pipeline, run.clock, run.frames_done.load(std::memory_order_relaxed));
    if (run.presenter->wants_to_end()) interrupted.store(true);
    cadence.arm(run.clock.now());
  }
  run.presenter->release();
}

/// Encodes and mixes: both allocate and write files, so they have a thread that nobody waits for.
void sound_main(void* context) {
  auto& run = *static_cast<Realtime*>(context);
  if (run.recorder == nullptr) return;
  while (!run.spine_is_over.load(std::memory_order_acquire))
    if (!run.recorder->round(*run.pipeline, run.clock)) run.clock.sleep_until(run.clock.now() + rt::Duration{2'000'000});
}

}  // namespace

rt::Result<double> run_realtime(Pipeline& pipeline, double frame_rate_hz, bool is_live, std::uint64_t frames_expected,
                                Presenter& presenter, Recorder* recorder) {
  Realtime run;
  run.pipeline = &pipeline;
  run.presenter = &presenter;
  run.recorder = recorder;
  run.frame_time = {static_cast<std::int64_t>(1e9 / frame_rate_hz)};
  run.is_live = is_live;
  const rt::HostTime begin = run.clock.now();
  // Priorities fall from the spine to the network, the refiner and the films. Rendering through a software driver needs a deep stack.
  const struct {
    rt::ThreadSpec spec;
    rt::RtThread::Function function;
  } table[] = {
      {{.name = "spine",
        .policy = rt::SchedulingPolicy::fifo,
        .priority = 60,
        .stack_bytes = std::size_t{512} << 10},
       spine_main},
      {{.name = "present",
        .policy = rt::SchedulingPolicy::fifo,
        .priority = 50,
        .stack_bytes = std::size_t{8} << 20},
       present_main},
      {{.name = "segment",
        .policy = rt::SchedulingPolicy::normal,
        .priority = 0,
        .stack_bytes = std::size_t{1} << 20},
       segment_main},
      {{.name = "refine",
        .policy = rt::SchedulingPolicy::normal,
        .priority = 0,
        .stack_bytes = std::size_t{256} << 10},
       refine_main},
      {{.name = "sound",
        .policy = rt::SchedulingPolicy::normal,
        .priority = 0,
        .stack_bytes = std::size_t{8} << 20},
       sound_main},
      {{.name = "capture",
        .policy = rt::SchedulingPolicy::fifo,
        .priority = 70,
        .stack_bytes = std::size_t{8} << 20},
       capture_main},
  };
  {
    std::array<rt::RtThread, 6> threads;
    for (std::size_t i = 0; i < threads.size(); ++i) {
      auto started = rt::RtThread::start(table[i].spec, table[i].function, &run);
      if (!started) {
        interrupted.store(true);
        run.capture_is_over.store(true);
        run.spine_is_over.store(true);
        return started.error();
      }
      threads[i] = std::move(*started);
    }
    Progress progress("realtime", frames_expected, run.clock);
    while (!run.spine_is_over.load(std::memory_order_acquire)) {
      progress.update(run.frames_done.load(std::memory_order_relaxed));
      run.clock.sleep_until(run.clock.now() + rt::Duration{50'000'000});
    }
  }
  return (run.clock.now() - begin).seconds();
}

}  // namespace tactus::firmware
