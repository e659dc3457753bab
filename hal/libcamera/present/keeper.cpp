#include "hal/libcamera/present/keeper.hpp"

namespace tactus::hal::libcamera {

Keeper::Keeper(lc::CameraManager& manager, const std::shared_ptr<lc::Camera>& camera, Mode mode, Wake& wake)
    : manager_(manager), id_(camera->id()), mode_(std::move(mode)), wake_(wake) {
  moveToThread(camera->thread());
}

Keeper::~Keeper() { invokeMethod(&Keeper::do_close, lc::ConnectionTypeBlocking); }

rt::Result<Session*> Keeper::open() {
  rt::Result<Session*> answer(nullptr);
  invokeMethod(&Keeper::do_open, lc::ConnectionTypeBlocking, &answer);
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

void Keeper::do_open(rt::Result<Session*>* answer) {
  const std::shared_ptr<lc::Camera> camera = manager_.get(id_);
  if (!camera) {
    *answer = rt::Error{rt::ExitCode::device_unavailable, "libcamera:" + id_ + ": went away while it was opened; plug it in again."};
    return;
  }
  auto session = Session::open(camera, mode_, wake_);
  if (!session) {
    *answer = session.error();
    return;
  }
  session_ = std::move(*session);
  *answer = session_.get();
}

void Keeper::do_close() { session_.reset(); }

void Keeper::look() {
  Search outcome = Search::failed;
  // A device that takes no buffers any more is still a camera to libcamera until udev's message has come.
  if (!session_ || session_->is_disconnected()) {
    session_.reset();
    rt::Result<Session*> answer(nullptr);
    do_open(&answer);
    if (answer) outcome = Search::found;
  }
  // Pairs with the acquire in searched().
  search_.store(outcome, std::memory_order_release);
  wake_.notify();
}

}  // namespace tactus::hal::libcamera
