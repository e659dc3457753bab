#include "hal/libcamera/present/color_camera.hpp"

#include <algorithm>
#include <array>
#include <cinttypes>
#include <cstdio>
#include <limits>

#include "hal/frames/convert.hpp"
#include "hal/frames/frame_outcome.hpp"
#include "rt/clock.hpp"
#include "rt/heap_guard.hpp"

namespace tactus::hal::libcamera {
namespace {
constexpr rt::Duration kBetweenSearches{500'000'000};
}  // namespace

LibcameraColor::LibcameraColor(std::shared_ptr<lc::CameraManager> manager, std::unique_ptr<Wake> wake,
                               std::unique_ptr<Keeper> keeper, Session& session)
    : manager_(std::move(manager)), wake_(std::move(wake)), keeper_(std::move(keeper)), session_(&session),
      time_last_{std::numeric_limits<std::int64_t>::min()} {
  counters_.first_rejection.reserve(frames::kSentenceBytes);
}

rt::Status LibcameraColor::read(std::span<std::uint8_t> rgb, FrameHeader& header, rt::Duration timeout) {
  const rt::Status status = hold(timeout);
  if (status != rt::Status::ok) return status;
  const std::uint32_t index = *held_;
  held_.reset();
  RawFrame raw = session_->raw(index);
  raw.header = header_;
  session_->begin_access(index);
  rt::Status converted = rt::Status::ok;
  if (raw.format == PixelFormat::mjpeg) {
    const rt::GuestScope libjpeg;
    converted = frames::to_rgb(raw, rgb);
  } else {
    converted = frames::to_rgb(raw, rgb);
  }
  if (converted == rt::Status::ok && tap_ != nullptr) tap_->take(Stream::color, raw);
  session_->end_access(index);
  give_back(index);
  if (converted != rt::Status::ok) {
    ++counters_.frames_rejected;
    say(raw.header.sequence, "does not decode");
    return rt::Status::corrupt;
  }
  ++counters_.frames_delivered;
  header = raw.header;
  return rt::Status::ok;
}

rt::Status LibcameraColor::peek(FrameHeader& header, rt::Duration timeout) {
  const rt::Status status = hold(timeout);
  if (status == rt::Status::ok) header = header_;
  return status;
}

void LibcameraColor::skip() {
  TACTUS_ASSERT(held_.has_value());
  const std::uint32_t index = *held_;
  held_.reset();
  if (tap_ != nullptr) {
    RawFrame raw = session_->raw(index);
    raw.header = header_;
    session_->begin_access(index);
    tap_->take(Stream::color, raw);
    session_->end_access(index);
  }
  give_back(index);
  ++counters_.frames_delivered;
}

rt::Status LibcameraColor::hold(rt::Duration timeout) {
  const rt::HostTime deadline = rt::Clock::monotonic().now() + timeout;
  if (session_ == nullptr && !is_back(deadline)) return rt::Status::device_lost;
  for (;;) {
    if (session_->is_lost()) return lose();
    if (held_) return rt::Status::ok;
    if (const std::optional<std::uint32_t> index = session_->take()) {
      const rt::Status status = judge(*index);
      if (status != rt::Status::stale) return status;
    } else if (!wake_->wait_until(deadline)) {
      return rt::Status::timeout;
    }
  }
}

rt::Status LibcameraColor::judge(std::uint32_t index) {
  const Session::Frame& frame = session_->frame(index);
  // What went by before anyone read is not missed.
  if (!has_begun_) sequence_next_ = frame.sequence;
  has_begun_ = true;
  // A session's numbers start at 0 again; a driver's that go back are treated alike, so that ours only rise.
  if (sequence_base_ + frame.sequence < sequence_next_) sequence_base_ = sequence_next_ - frame.sequence;
  const std::uint64_t sequence = sequence_base_ + frame.sequence;
  counters_.frames_missing += sequence - sequence_next_;
  sequence_next_ = sequence + 1;
  const char* fault = nullptr;
  if (!frame.is_good)
    fault = "came with an error";
  else if (!frames::is_whole(session_->raw(index)))
    fault = "is shorter than its size promises";
  if (fault != nullptr) {
    give_back(index);
    ++counters_.frames_rejected;
    say(sequence, fault);
    return rt::Status::corrupt;
  }
  if (frame.time <= time_last_) {
    give_back(index);
    ++counters_.timestamps_rejected;
    say(sequence, "is not later than the one before it");
    return rt::Status::stale;
  }
  time_last_ = frame.time;
  header_ = {frame.time, sequence, frame.arrived};
  held_ = index;
  return rt::Status::ok;
}

bool LibcameraColor::is_back(rt::HostTime deadline) {
  for (;;) {
    const Keeper::Search search = keeper_->searched();
    const rt::HostTime now = rt::Clock::monotonic().now();
    if (search == Keeper::Search::found) {
      session_ = keeper_->found();
      return true;
    }
    const bool may_search = search != Keeper::Search::running;
    if (may_search && now >= next_search_) {
      next_search_ = now + kBetweenSearches;
      const rt::GuestScope libcamera;
      keeper_->search();
      continue;
    }
    if (now >= deadline) return false;
    (void)wake_->wait_until(may_search ? std::min(deadline, next_search_) : deadline);
  }
}

rt::Status LibcameraColor::lose() {
  ++counters_.losses;
  held_.reset();
  session_ = nullptr;
  next_search_ = {};
  return rt::Status::device_lost;
}

void LibcameraColor::give_back(std::uint32_t index) {
  const rt::GuestScope libcamera;
  session_->give_back(index);
}

void LibcameraColor::say(std::uint64_t sequence, const char* what) {
  if (!counters_.first_rejection.empty()) return;
  std::array<char, frames::kSentenceBytes> sentence{};
  std::snprintf(sentence.data(), sentence.size(), "Frame %" PRIu64 " of the libcamera camera %s.", sequence, what);
  counters_.first_rejection.assign(sentence.data());
}

}  // namespace tactus::hal::libcamera
