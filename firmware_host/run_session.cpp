#include "firmware_host/run_session.hpp"

#include <csignal>
#include <cstdio>

#include "firmware_host/progress.hpp"
#include "hal/display.hpp"
#include "rt/heap_guard.hpp"
#include "rt/thread.hpp"

namespace tactus::firmware {
namespace {

constexpr rt::Duration kContactPeriod{16'666'667};  // two physics steps
constexpr rt::Duration kIdle{500'000};              // between looks into an empty ring
constexpr float kHiddenMin = 0.2f, kHiddenMax = 0.8f;

extern "C" void on_signal(int) { interrupted.store(true, std::memory_order_relaxed); }

}  // namespace

std::atomic<bool> interrupted{false};

void catch_signals() {
  struct sigaction action {};
  action.sa_handler = on_signal;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

PictureTaker::PictureTaker(std::uint64_t frames_expected)
    : every_(frames_expected > 0 ? std::max<std::uint64_t>(1, frames_expected / 4) : 60) {}

Picture PictureTaker::grab(Pipeline& pipeline, rt::Clock clock, float overlay, const std::string& title,
                           const std::string& caption) {
  Picture picture;
  if (pipeline.render_round(clock, overlay) != rt::Status::ok) return picture;
  picture.title = title;
  picture.caption = caption;
  picture.width = pipeline.picture_camera().width;
  picture.height = pipeline.picture_camera().height;
  picture.rgb.assign(pipeline.picture().begin(), pipeline.picture().end());
  return picture;
}

void PictureTaker::consider(Pipeline& pipeline, rt::Clock clock, std::uint64_t frame) {
  const auto hidden = pipeline.occluded_share();
  if (hidden && *hidden >= kHiddenMin && *hidden <= kHiddenMax) {
    const float good = *hidden <= 0.5f ? *hidden : 1.0f - *hidden;  // half hidden shows it best
    if (good > best_hidden_ + 0.02f) {
      Picture picture =
          grab(pipeline, clock, 0, "Virtual things behind real ones",
               "Frame " + std::to_string(frame) + ": real depth hides " +
                   std::to_string(static_cast<int>(*hidden * 100)) + " % of what was thrown into the room.");
      if (picture.width > 0) {
        hidden_ = std::move(picture);
        best_hidden_ = good;
      }
    }
  }
  if (frame % every_ == every_ - 1 && spread_.size() < 8) {
    for (const float overlay : {0.0f, 0.6f}) {
      Picture picture =
          grab(pipeline, clock, overlay, overlay > 0 ? "Materials" : "Video and virtual things",
               "Frame " + std::to_string(frame) +
                   (overlay > 0 ? ": the map's labels over the video." : ": as a headset would show it."));
      if (picture.width > 0) spread_.push_back(std::move(picture));
    }
  }
}

std::vector<Picture> PictureTaker::take() {
  std::vector<Picture> all;
  if (hidden_.width > 0) all.push_back(std::move(hidden_));
  for (auto it = spread_.rbegin(); it != spread_.rend(); ++it)
    all.push_back(std::move(*it));  // late maps are fuller
  return all;
}

double run_lockstep(Pipeline& pipeline, double frame_rate_hz, std::uint64_t frames_expected,
                    PictureTaker* pictures) {
  const rt::Clock clock = rt::Clock::monotonic();
  const rt::Duration frame_time{static_cast<std::int64_t>(1e9 / frame_rate_hz)};
  Progress progress("lockstep", frames_expected, clock);
  const rt::HostTime begin = clock.now();
  std::uint64_t frame = 0;
  while (!interrupted.load(std::memory_order_relaxed)) {
    const rt::Status captured = pipeline.capture_round(clock);
    if (captured == rt::Status::end_of_stream || captured == rt::Status::device_lost) break;
    if (captured != rt::Status::ok) continue;  // rejected by the sensor and counted there
    (void)pipeline.spine_round(clock, rt::kNoDeadline);
    (void)pipeline.segment_round(clock);
    (void)pipeline.refine_round(clock);
    (void)pipeline.contact_round(clock, frame_time);
    if (pictures != nullptr) pictures->consider(pipeline, clock, frame);
    progress.update(++frame);
  }
  return (clock.now() - begin).seconds();
}

namespace {

struct Realtime {
  Pipeline* pipeline = nullptr;
  hal::Display* display = nullptr;
  PictureTaker* pictures = nullptr;
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
  while (!interrupted.load(std::memory_order_relaxed)) {
    const rt::Status captured = run.pipeline->capture_round(run.clock);
    if (captured == rt::Status::end_of_stream || captured == rt::Status::device_lost) break;
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
  std::uint64_t considered = 0;
  while (!run.spine_is_over.load(std::memory_order_acquire)) {
    run.clock.sleep_until(cadence.next());
    (void)run.pipeline->contact_round(run.clock, kContactPeriod);
    const std::uint64_t frame = run.frames_done.load(std::memory_order_relaxed);
    if (run.pictures != nullptr && frame > considered) {
      run.pictures->consider(*run.pipeline, run.clock, frame);
      considered = frame;
    }
    cadence.arm(run.clock.now());
  }
  if (run.display != nullptr) run.display->release();
}

}  // namespace

rt::Result<double> run_realtime(Pipeline& pipeline, double frame_rate_hz, bool is_live,
                                std::uint64_t frames_expected, hal::Display* display,
                                PictureTaker* pictures) {
  Realtime run;
  run.pipeline = &pipeline;
  run.display = display;
  run.pictures = pictures;
  run.frame_time = {static_cast<std::int64_t>(1e9 / frame_rate_hz)};
  run.is_live = is_live;
  const rt::HostTime begin = run.clock.now();
  // Priorities fall from the spine to the network. Rendering through a software driver needs a deep stack.
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
      {{.name = "capture",
        .policy = rt::SchedulingPolicy::fifo,
        .priority = 70,
        .stack_bytes = std::size_t{8} << 20},
       capture_main},
  };
  {
    std::array<rt::RtThread, 5> threads;
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
