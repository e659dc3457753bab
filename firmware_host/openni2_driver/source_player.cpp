#include "firmware_host/openni2_driver/source_player.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>

#include "rt/clock.hpp"

namespace tactus::openni2_driver {
namespace {

// A program starts one stream after the other and joins them; by then, and not before, frames come.
constexpr rt::Duration kWarmUp{50'000'000};
constexpr rt::Duration kReadPatience{1'000'000'000};
constexpr std::int64_t kPairDistanceMax_us = 20'000;

std::size_t pixels_of(const hal::Intrinsics& k) {
  return static_cast<std::size_t>(k.width) * static_cast<std::size_t>(k.height);
}

}  // namespace

SourcePlayer::SourcePlayer(hal::Sensor sensor, Settings settings)
    : sensor_(std::move(sensor)), settings_(std::move(settings)), raw_(pixels_of(sensor_.calibration.depth)) {
  depth_.pixels.resize(2 * raw_.size());
  if (sensor_.color)
    color_.pixels.resize(3 * pixels_of(sensor_.calibration.color));
  else
    color_.has_ended = true;
}

SourcePlayer::~SourcePlayer() {
  unplug();
  if (thread_.joinable()) thread_.join();
}

void SourcePlayer::start(hal::Stream stream, FrameSink& sink) {
  const std::lock_guard lock(mutex_);
  const bool was_running = is_running();
  (stream == hal::Stream::depth ? depth_ : color_).sink = &sink;
  if (was_running || is_unplugged_) return;
  if (thread_.joinable()) thread_.join();
  has_begun_ = false;
  thread_ = std::thread([this] { play(); });
}

void SourcePlayer::stop(hal::Stream stream) {
  std::thread ended;
  {
    const std::lock_guard lock(mutex_);
    (stream == hal::Stream::depth ? depth_ : color_).sink = nullptr;
    if (!is_running()) ended.swap(thread_);
  }
  changed_.notify_all();
  if (ended.joinable()) ended.join();
}

void SourcePlayer::set_synced(bool is_synced) {
  const std::lock_guard lock(mutex_);
  is_synced_ = is_synced;
}

void SourcePlayer::unplug() {
  {
    const std::lock_guard lock(mutex_);
    is_unplugged_ = true;
  }
  changed_.notify_all();
}

void SourcePlayer::play() {
  std::unique_lock lock(mutex_);
  while (is_running()) {
    // Sources are this thread's alone; a stream may be stopped while they decode.
    lock.unlock();
    fill_depth();
    fill_color();
    const bool has_ended = !depth_.is_filled && !color_.is_filled;
    const bool goes_on = !has_ended || (settings_.has_loop && rewind());
    lock.lock();
    if (!goes_on) changed_.wait(lock, [this] { return !is_running(); });
    if (has_ended) continue;
    const bool is_pair = depth_.is_filled && color_.is_filled;
    const bool is_color_first = color_.is_filled && (!depth_.is_filled || color_.time_us < depth_.time_us);
    Track& first = is_color_first ? color_ : depth_;
    if (!is_synced_ || !is_pair) {
      if (wait_until_due(lock, first.time_us)) show(first, first.index);
    } else if (std::abs(depth_.time_us - color_.time_us) > kPairDistanceMax_us) {
      first.is_filled = false;
    } else if (wait_until_due(lock, std::max(depth_.time_us, color_.time_us))) {
      show(depth_, depth_.index);
      show(color_, depth_.index);
    }
  }
}

void SourcePlayer::fill_depth() {
  while (!depth_.is_filled && !depth_.has_ended) {
    hal::FrameHeader header;
    const rt::Status status = sensor_.depth->read(raw_, header, kReadPatience);
    depth_.has_ended = status == rt::Status::end_of_stream;
    if (status != rt::Status::ok) continue;
    const double mm_per_unit = sensor_.calibration.depth_m_per_unit * 1000;
    for (std::uint16_t& value : raw_) {
      const double mm = std::round(value * mm_per_unit);
      value = mm > kDepthMax_mm ? std::uint16_t{0} : static_cast<std::uint16_t>(mm);
    }
    std::memcpy(depth_.pixels.data(), raw_.data(), depth_.pixels.size());
    note(depth_, header);
  }
}

void SourcePlayer::fill_color() {
  while (!color_.is_filled && !color_.has_ended) {
    hal::FrameHeader header;
    const rt::Status status = sensor_.color->read(color_.pixels, header, kReadPatience);
    color_.has_ended = status == rt::Status::end_of_stream;
    if (status == rt::Status::ok) note(color_, header);
  }
}

void SourcePlayer::note(Track& track, const hal::FrameHeader& header) {
  track.time_us = header.time.ns / 1000 + shift_us_;
  track.index = static_cast<int>(header.sequence) + 1 + index_shift_;
  track.is_filled = true;
  last_us_ = std::max(last_us_, track.time_us);
  last_index_ = std::max(last_index_, track.index);
}

bool SourcePlayer::rewind() {
  // First gone, then anew: a room of its own takes 10 MB, and labels hold on to it, too.
  sensor_.labels.reset();
  sensor_.depth.reset();
  sensor_.color.reset();
  auto again = open_source(settings_.source);
  if (!again) return false;
  sensor_.depth = std::move(again->depth);
  sensor_.color = std::move(again->color);
  depth_.has_ended = false;
  color_.has_ended = sensor_.color == nullptr;
  index_shift_ = last_index_;
  // The first frame again comes one period after the last.
  shift_us_ = 0;
  fill_depth();
  if (!depth_.is_filled) return false;
  shift_us_ = last_us_ + static_cast<std::int64_t>(1e6 / sensor_.frame_rate_hz) - depth_.time_us;
  depth_.time_us += shift_us_;
  return true;
}

bool SourcePlayer::wait_until_due(std::unique_lock<std::mutex>& lock, std::int64_t time_us) {
  const rt::Clock clock = rt::Clock::monotonic();
  if (!has_begun_) {
    has_begun_ = true;
    begin_ = clock.now() + kWarmUp;
    begin_us_ = time_us;
  }
  const double wait_ns = static_cast<double>(time_us - begin_us_) * 1000 / settings_.speed;
  const rt::HostTime due = begin_ + rt::Duration{static_cast<std::int64_t>(wait_ns)};
  const rt::Duration left = due - clock.now();
  if (left.ns > 0) (void)changed_.wait_for(lock, std::chrono::nanoseconds(left.ns), [this] { return !is_running(); });
  return is_running();
}

void SourcePlayer::show(Track& track, int index) {
  track.is_filled = false;
  if (track.sink != nullptr && track.time_us >= 0)
    track.sink->show(track.pixels, static_cast<std::uint64_t>(track.time_us), index);
}

}  // namespace tactus::openni2_driver
