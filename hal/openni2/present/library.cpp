#include "hal/openni2/present/library.hpp"

#include <OniVersion.h>
#include <pthread.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <thread>

#include "hal/openni2/present/oni_player.hpp"
#include "rt/clock.hpp"
#include "rt/heap_guard.hpp"

namespace tactus::hal::openni2 {
namespace {

// How long a task waits for the library to come back from waiting for frames.
constexpr int kPumpWait_ms = 20;
constexpr std::chrono::milliseconds kTendPeriod{100};

Library* the_library = nullptr;

}  // namespace

rt::Result<Library*> Library::get() {
  static const rt::Result<Library*> started = []() -> rt::Result<Library*> {
    // Never destroyed, as drivers may call it until the process is gone.
    auto* library = new Library;
    the_library = library;
    std::thread thread([library] { library->work_for_ever(); });
    (void)pthread_setname_np(thread.native_handle(), "tactus_openni2");
    thread.detach();
    // A second oniInitialize() after one that failed answers "ok", with no drivers: hence once and for all.
    OniStatus status = ONI_STATUS_ERROR;
    std::string words;
    library->call([&] {
      status = oniInitialize(ONI_API_VERSION);
      if (status != ONI_STATUS_OK) {
        words = last_words();
        return;
      }
      OniDeviceCallbacks callbacks{[](const OniDeviceInfo*, void*) {}, &Library::on_disconnected, &Library::on_state};
      (void)oniRegisterDeviceCallbacks(&callbacks, library, &library->callbacks_);
    });
    if (status != ONI_STATUS_OK)
      return rt::Error{rt::ExitCode::device_unavailable,
                       "OpenNI2 does not start: " + words +
                           "; its drivers belong into the folder OpenNI2/Drivers beside its library."};
    // Before the library's own statics go: from then on nothing calls it.
    std::atexit([] {
      the_library->is_parked_.store(true, std::memory_order_relaxed);  // relaxed: a wish; the call below is the barrier
      the_library->call([] {});
    });
    return library;
  }();
  return started;
}

void Library::run(Task& task) {
  std::unique_lock lock(mutex_);
  (last_task_ == nullptr ? first_task_ : last_task_->next) = &task;
  last_task_ = &task;
  task_came_.notify_one();
  task_done_.wait(lock, [&task] { return task.is_done; });
}

Library::Task* Library::next_task(bool may_wait) {
  std::unique_lock lock(mutex_);
  if (may_wait) (void)task_came_.wait_for(lock, kTendPeriod, [this] { return first_task_ != nullptr; });
  Task* task = first_task_;
  if (task == nullptr) return nullptr;
  first_task_ = task->next;
  if (first_task_ == nullptr) last_task_ = nullptr;
  return task;
}

void Library::work_for_ever() {
  for (;;) {
    const bool is_parked = is_parked_.load(std::memory_order_relaxed);
    if (Task* task = next_task(is_parked || streams_.empty())) {
      task->run(task->work);
      const std::lock_guard lock(mutex_);
      task->is_done = true;
      task_done_.notify_all();
      continue;
    }
    if (is_parked) continue;
    for (Tended* device : tended_) device->tend(rt::Clock::monotonic().now());
    if (!streams_.empty()) pump();
  }
}

void Library::pump() {
  const rt::RtScope step;
  for (StreamTaker* taker : takers_) taker->release_spent();
  int index = 0;
  OniFrame* frame = nullptr;
  {
    const rt::GuestScope guest;
    const int count = static_cast<int>(streams_.size());
    if (oniWaitForAnyStream(streams_.data(), count, &index, kPumpWait_ms) != ONI_STATUS_OK) return;
  }
  const rt::HostTime arrived = rt::Clock::monotonic().now();
  {
    const rt::GuestScope guest;
    // There is a frame, so it does not wait.
    if (oniStreamReadFrame(streams_[static_cast<std::size_t>(index)], &frame) != ONI_STATUS_OK || frame == nullptr) return;
  }
  takers_[static_cast<std::size_t>(index)]->take(frame, arrived);
}

void Library::add(StreamTaker& taker, OniStreamHandle stream) {
  takers_.push_back(&taker);
  streams_.push_back(stream);
}

void Library::remove(StreamTaker& taker) {
  const auto at = std::find(takers_.begin(), takers_.end(), &taker);
  if (at == takers_.end()) return;
  streams_.erase(streams_.begin() + (at - takers_.begin()));
  takers_.erase(at);
}

void Library::add(Tended& device) {
  tended_.push_back(&device);
  const std::lock_guard lock(told_mutex_);
  told_.push_back(&device);
}

void Library::remove(Tended& device) {
  std::erase(tended_, &device);
  const std::lock_guard lock(told_mutex_);
  std::erase(told_, &device);
}

std::vector<OniDeviceInfo> Library::devices() {
  OniDeviceInfo* infos = nullptr;
  int count = 0;
  std::vector<OniDeviceInfo> out;
  if (oniGetDeviceList(&infos, &count) != ONI_STATUS_OK) return out;
  for (int i = 0; i < count; ++i)
    if (!is_recording_uri(infos[i].uri)) out.push_back(infos[i]);
  (void)oniReleaseDeviceList(infos);
  return out;
}

void Library::on_disconnected(const OniDeviceInfo* info, void* cookie) {
  auto& library = *static_cast<Library*>(cookie);
  const std::lock_guard lock(library.told_mutex_);
  for (Tended* device : library.told_) device->on_lost(*info);
}

void Library::on_state(const OniDeviceInfo* info, OniDeviceState state, void* cookie) {
  if (state == ONI_DEVICE_STATE_ERROR) on_disconnected(info, cookie);
}

std::string last_words() {
  const char* said = oniGetExtendedError();
  std::string words(said != nullptr ? said : "");
  std::replace_if(words.begin(), words.end(), [](char c) { return static_cast<unsigned char>(c) < ' '; }, ' ');
  words.erase(words.find_last_not_of(" .") + 1);
  return words;
}

}  // namespace tactus::hal::openni2
