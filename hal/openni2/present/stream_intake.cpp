#include "hal/openni2/present/stream_intake.hpp"

#include <chrono>

#include "rt/heap_guard.hpp"

namespace tactus::hal::openni2 {
namespace {

void release(OniFrame* frame) {
  const rt::GuestScope guest;
  if (frame != nullptr) oniFrameRelease(frame);
}

}  // namespace

rt::SensorTime DeviceClock::at(std::uint64_t device_us, rt::HostTime arrived) {
  const std::int64_t device_ns = static_cast<std::int64_t>(device_us) * 1000;
  rt::SensorTime time{device_ns + offset_ns_};
  if (is_first_ && has_last_ && time <= last_) {
    const rt::SensorTime expected = last_ + (arrived - last_arrived_);
    offset_ns_ += expected.ns - time.ns;
    time = expected;
  }
  is_first_ = false;
  if (!has_last_ || time > last_) {
    last_ = time;
    last_arrived_ = arrived;
    has_last_ = true;
  }
  return time;
}

StreamIntake::StreamIntake(DeviceClock& clock, std::size_t frame_bytes) : clock_(clock), buffers_(frame_bytes, kBuffers) {}

StreamIntake::~StreamIntake() {
  release_spent();
  release(front_.frame);
}

void StreamIntake::connect() {
  is_first_ = true;
  const std::lock_guard lock(mutex_);
  is_away_ = false;
}

void StreamIntake::disconnect() {
  std::array<Frame, kHeld> held;
  {
    const std::lock_guard lock(mutex_);
    held = held_;
    held_ = {};
    held_count_ = 0;
  }
  for (const Frame& frame : held) release(frame.frame);
  release_spent();
}

void StreamIntake::take(OniFrame* frame, rt::HostTime arrived) {
  // Device indices may begin anew with a connection, and some do while they run; ours go on rising.
  std::int64_t sequence = frame->frameIndex + sequence_offset_;
  const auto next = static_cast<std::int64_t>(last_sequence_ + 1);
  if (has_last_ && (is_first_ || sequence < next)) {
    sequence_offset_ += next - sequence;
    sequence = next;
  }
  is_first_ = false;
  has_last_ = true;
  last_sequence_ = static_cast<std::uint64_t>(sequence < 0 ? 0 : sequence);
  const Frame taken{frame, {clock_.at(frame->timestamp, arrived), last_sequence_, arrived}};
  OniFrame* oldest = nullptr;
  {
    const std::lock_guard lock(mutex_);
    if (held_count_ == kHeld) {
      oldest = held_[held_first_].frame;
      held_[held_first_] = {};
      held_first_ = (held_first_ + 1) % kHeld;
      --held_count_;
    }
    held_[(held_first_ + held_count_++) % kHeld] = taken;
  }
  came_.notify_one();
  release(oldest);
}

void StreamIntake::release_spent() {
  std::array<OniFrame*, kHeld + 1> spent{};
  {
    const std::lock_guard lock(mutex_);
    spent = spent_;
    spent_ = {};
    spent_count_ = 0;
  }
  for (OniFrame* frame : spent) release(frame);
}

void StreamIntake::lose() {
  {
    const std::lock_guard lock(mutex_);
    if (is_away_) return;
    is_away_ = true;
    ++losses_;
  }
  came_.notify_one();
}

rt::Status StreamIntake::await(rt::Duration timeout) {
  if (has_front()) return rt::Status::ok;
  std::unique_lock lock(mutex_);
  (void)came_.wait_for(lock, std::chrono::nanoseconds(timeout.ns), [this] { return is_away_ || held_count_ > 0; });
  if (is_away_) return rt::Status::device_lost;
  if (held_count_ == 0) return rt::Status::timeout;
  front_ = held_[held_first_];
  held_[held_first_] = {};
  held_first_ = (held_first_ + 1) % kHeld;
  --held_count_;
  return rt::Status::ok;
}

void StreamIntake::pass_over_old() {
  const std::lock_guard lock(mutex_);
  for (; held_count_ > 1; --held_count_) {
    spent_[spent_count_++] = held_[held_first_].frame;
    held_[held_first_] = {};
    held_first_ = (held_first_ + 1) % kHeld;
  }
}

void StreamIntake::done() {
  const std::lock_guard lock(mutex_);
  // There is room: a frame comes to the front from those held, and before more are held the spent ones go back.
  spent_[spent_count_++] = front_.frame;
  front_ = {};
}

std::uint64_t StreamIntake::losses() {
  const std::lock_guard lock(mutex_);
  return losses_;
}

}  // namespace tactus::hal::openni2
