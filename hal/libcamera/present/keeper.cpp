#include "hal/libcamera/present/keeper.hpp"

namespace tactus::hal::libcamera {

Keeper::Keeper(lc::CameraManager& manager, const std::shared_ptr<lc::Camera>& camera, Mode mode, Wake& wake)
    : manager_(manager), id_(camera->id()), mode_(std::move(mode)), wake_(wake) {
  moveToThread(camera->thread());
}

Keeper::~Keeper() {
  invokeMethod(&Keeper::do_close, lc::ConnectionTypeQueued);
  wait_until_done();
}

rt::Result<Session*> Keeper::open() {
  rt::Result<Session*> answer(nullptr);
  invokeMethod(&Keeper::do_open, lc::ConnectionTypeQueued, &answer);
  wait_until_done();
  return answer;
}

void Keeper::search() {
  // Relaxed: the message that follows orders it for libcamera's thread, which alone writes it next.
  search_.store(Search::running, std::memory_order_relaxed);
  invokeMethod(&Keeper::look, lc::ConnectionTypeQueued);
}

Session* Keeper::found() {
  // Relaxed: searched() has seen what came with it.
  search_.store(Search::idle, std::memory_order_relaxed);
  return session_.get();
}

rt::Result<Session*> Keeper::open_now() {
  const std::shared_ptr<lc::Camera> camera = manager_.get(id_);
  if (!camera)
    return rt::Error{rt::ExitCode::device_unavailable,
                     "libcamera:" + id_ + ": went away while it was opened; plug it in again."};
  auto session = Session::open(camera, mode_, wake_);
  if (!session) return session.error();
  session_ = std::move(*session);
  return session_.get();
}

void Keeper::do_open(rt::Result<Session*>* answer) {
  *answer = open_now();
  tell_done();
}

void Keeper::do_close() {
  session_.reset();
  tell_done();
}

void Keeper::look() {
  Search outcome = Search::failed;
  // A device that takes no buffers any more is still a camera to libcamera until udev's message has come.
  if (!session_ || session_->is_disconnected()) {
    session_.reset();
    if (open_now()) outcome = Search::found;
  }
  // Pairs with the acquire in searched().
  search_.store(outcome, std::memory_order_release);
  wake_.notify();
}

void Keeper::tell_done() {
  const std::lock_guard lock(mutex_);
  is_done_ = true;
  done_.notify_one();  // before the lock is given up: the waiter may then destroy both
}

void Keeper::wait_until_done() {
  std::unique_lock lock(mutex_);
  done_.wait(lock, [this] { return is_done_; });
  is_done_ = false;
}

}  // namespace tactus::hal::libcamera
