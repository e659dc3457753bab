// The one OpenNI2 of this process: started once, used by one thread that lives as long as the process, never shut down.
//
// OpenNI 2.2 as Debian builds it keeps a text buffer for every thread that ever called it, and with every new thread asks
// the system whether the others are still there, in a way that crashes once one of them has ended. So no thread of ours
// calls it but this one: the others hand it what is to be done.
#pragma once

#include <OniCAPI.h>

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <string>
#include <type_traits>
#include <vector>

#include "rt/status.hpp"
#include "rt/time.hpp"

namespace tactus::hal::openni2 {

/// A running stream of a live device. Called on the library's thread, without heap.
class StreamTaker {
 public:
  virtual ~StreamTaker() = default;
  /// The frame is the taker's to release.
  virtual void take(OniFrame* frame, rt::HostTime arrived) = 0;
  /// Before the library is asked for more: releases what readers are done with.
  virtual void release_spent() = 0;
};

/// An opened live device.
class Tended {
 public:
  virtual ~Tended() = default;
  /// On a driver's thread: takes note and returns.
  virtual void on_lost(const OniDeviceInfo& info) = 0;
  /// On the library's thread, ten times a second or more often.
  virtual void tend(rt::HostTime now) = 0;
};

class Library {
 public:
  /// Starts it at the first call; that one's failure is everybody's. Boot; any thread.
  static rt::Result<Library*> get();

  /// Does `work` on the library's thread and waits for it, 20 ms longer than it takes while a live device runs. Any thread
  /// but that one; no heap.
  template <typename Work>
  void call(Work&& work) {
    Task task;
    task.work = &work;
    task.run = [](void* w) { (*static_cast<std::remove_reference_t<Work>*>(w))(); };
    run(task);
  }

  // On the library's thread only:
  void add(StreamTaker& taker, OniStreamHandle stream);
  void remove(StreamTaker& taker);
  void add(Tended& device);
  /// When it returns, the device is told nothing more.
  void remove(Tended& device);
  /// Devices that are plugged in; recordings that were opened, which the library counts among them, are left out.
  std::vector<OniDeviceInfo> devices();

 private:
  struct Task {
    void* work = nullptr;
    void (*run)(void*) = nullptr;
    Task* next = nullptr;
    bool is_done = false;
  };
  Library() = default;
  void run(Task& task);
  void work_for_ever();
  /// Null after a while without one, at once when `may_wait` is false.
  Task* next_task(bool may_wait);
  void pump();
  static void on_disconnected(const OniDeviceInfo* info, void* cookie);
  static void on_state(const OniDeviceInfo* info, OniDeviceState state, void* cookie);

  std::mutex mutex_;  // guards tasks and is_done of each
  std::condition_variable task_came_, task_done_;
  Task* first_task_ = nullptr;
  Task* last_task_ = nullptr;
  std::atomic<bool> is_parked_{false};
  OniCallbackHandle callbacks_ = nullptr;  // never given back

  // The library's thread's:
  std::vector<StreamTaker*> takers_;
  std::vector<OniStreamHandle> streams_;  // of each taker
  std::vector<Tended*> tended_;

  // The same devices for the drivers' threads, which a device being closed may wait for: never held during a call into
  // the library.
  std::mutex told_mutex_;
  std::vector<Tended*> told_;
};

/// The library's own words on what went wrong, on one line; empty when it says nothing. On its thread, at once after a call.
std::string last_words();

}  // namespace tactus::hal::openni2
