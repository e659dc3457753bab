// Opens, closes and searches for one camera on libcamera's own thread, where nothing of it can be under way meanwhile: the
// reading thread asks, and waits no longer than it wants to.
#pragma once

#include <libcamera/libcamera.h>

#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>

#include "hal/libcamera/present/session.hpp"

namespace tactus::hal::libcamera {

class Keeper final : public lc::Object {
 public:
  enum class Search : int { idle, running, failed, found };

  /// `manager` and `wake` outlive it. Boot.
  Keeper(lc::CameraManager& manager, const std::shared_ptr<lc::Camera>& camera, Mode mode, Wake& wake);
  ~Keeper() override;

  /// Once, first. Waits for it. Boot.
  rt::Result<Session*> open();
  /// Closes the session that was lost and looks for a camera of the same id. Does not wait; libcamera allocates a message.
  /// The session is libcamera's thread's from here until searched() says found. Reading thread.
  void search();
  [[nodiscard]] Search searched() const noexcept {
    // Pairs with the release in look(): what it made is seen.
    return search_.load(std::memory_order_acquire);
  }
  /// The session that a search found. Reading thread, once per search.
  Session* found();

 private:
  rt::Result<Session*> open_now();
  void do_open(rt::Result<Session*>* answer);
  void do_close();
  void look();
  void tell_done();
  void wait_until_done();

  lc::CameraManager& manager_;
  std::string id_;
  Mode mode_;
  Wake& wake_;
  std::unique_ptr<Session> session_;
  std::atomic<Search> search_{Search::idle};
  // libcamera's own way to wait for a message (0.0.3) signals a semaphore that its waiter may have destroyed by then.
  std::mutex mutex_;  // guards is_done_
  std::condition_variable done_;
  bool is_done_ = false;
};

}  // namespace tactus::hal::libcamera
