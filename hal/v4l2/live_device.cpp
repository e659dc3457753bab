#include "hal/v4l2/live_device.hpp"

#include <linux/videodev2.h>
#include <poll.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <ctime>

#include "hal/frames/convert.hpp"
#include "hal/frames/frame_outcome.hpp"
#include "hal/v4l2/fourcc.hpp"
#include "rt/clock.hpp"

namespace tactus::hal::v4l2 {
namespace {

constexpr rt::Duration kLookEvery{500'000'000};  // a plugged-in USB camera takes longer to come up by itself

rt::HostTime now() { return rt::Clock::monotonic().now(); }

/// uvcvideo flags its stamps as monotonic also when it was loaded with clock=CLOCK_REALTIME.
bool is_wall_clock(const NodeInfo& info) {
  if (std::string_view(info.driver.data()) != "uvcvideo") return false;
  std::array<char, 32> text;
  return read_file("/sys/module/uvcvideo/parameters/clock", text).find("REALTIME") != std::string_view::npos;
}

}  // namespace

rt::Result<void> LiveDevice::open(const V4l2Request& request, Stream stream) {
  counters_.first_rejection.reserve(frames::kSentenceBytes);
  if (request.device.size() >= path_.size())
    return rt::Error{rt::ExitCode::bad_usage, request.device + " is too long for the path of a device"};
  request.device.copy(path_.data(), path_.size() - 1);
  int error = 0;
  node_ = open_node(path_.data(), error);
  if (!node_.is_open()) return rt::Error{rt::ExitCode::device_unavailable, open_trouble(request.device, error)};
  if (read_info(node_.get(), info_) != 0)
    return rt::Error{rt::ExitCode::device_unavailable,
                     request.device + " is no V4L2 device; tactus devices lists those there are"};
  const std::string name = name_for_people(request.device, info_);
  if (!info_.is_capture())
    return rt::Error{rt::ExitCode::device_unavailable,
                     name + " captures no images" +
                         (info_.is_metadata() ? ", only what goes with those of another node" : "") +
                         "; tactus devices lists the nodes that do"};

  auto agreement = agree(node_.get(), info_, {stream, request.format, request.mode}, name);
  if (!agreement) return agreement.error();
  agreement_ = std::move(*agreement);
  auto controls = set_controls(node_.get(), request.controls, name);
  if (!controls) return controls.error();
  controls_ = std::move(*controls);
  has_monotonic_stamps_ = !is_wall_clock(info_);
  start_metadata();
  if (auto attached = buffers_.attach(node_.get(), agreement_, name); !attached) return attached;
  has_host_clock_ = (buffers_.stamp_flags() & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC &&
                    has_monotonic_stamps_;
  const char* what = "";
  if (error = start_stream(what); error != 0) {
    if (error == EBUSY)
      return rt::Error{rt::ExitCode::device_unavailable, name + " is in use by another program; close it first"};
    if (error == ENOSPC)
      return rt::Error{rt::ExitCode::device_unavailable,
                       name + " finds too little room on its USB bus; plug it into another port, or ask for a smaller size, "
                              "a lower rate or MJPG"};
    return rt::Error{rt::ExitCode::device_unavailable,
                     name + " does not start (" + what + ": " + std::strerror(error) + "); unplug it and plug it in again"};
  }
  return {};
}

/// Before the image buffers are there: with them uvcvideo lets nobody choose the form of the metadata.
void LiveDevice::start_metadata() noexcept {
  if (has_monotonic_stamps_) (void)metadata_.start(node_.get(), info_);
}

int LiveDevice::start_stream(const char*& what) noexcept {
  refused_ = 0;
  what = "VIDIOC_QBUF";
  for (std::uint32_t i = 0; i < buffers_.count(); ++i)
    if (const int error = buffers_.queue(node_.get(), i); error != 0) return error;
  what = "VIDIOC_STREAMON";
  int type = static_cast<int>(agreement_.format.type);
  return call(node_.get(), VIDIOC_STREAMON, &type);
}

rt::Status LiveDevice::acquire(rt::Duration timeout) {
  if (is_held_) return rt::Status::ok;
  const rt::HostTime deadline = now() + timeout;
  if (!node_.is_open()) {
    const rt::Status status = look_again(deadline);
    if (status != rt::Status::ok) return status;
  }
  if (!give_back_refused()) return lose();
  if (!has_begun_) pass_over_stale_frames();
  has_begun_ = true;
  for (;;) {
    Filled filled;
    const int error = buffers_.dequeue(node_.get(), filled);
    rt::Status status = rt::Status::ok;
    if (error == 0)
      status = take(filled);
    else if (error == EAGAIN)
      status = wait(deadline);
    else
      return lose();
    if (status != rt::Status::skipped) return status;
  }
}

rt::Status LiveDevice::wait(rt::HostTime deadline) noexcept {
  const std::int64_t left_ns = std::max<std::int64_t>(0, (deadline - now()).ns);
  const timespec left{static_cast<std::time_t>(left_ns / 1'000'000'000), static_cast<long>(left_ns % 1'000'000'000)};
  pollfd waited{node_.get(), POLLIN, 0};
  const int answer = ::ppoll(&waited, 1, &left, nullptr);
  if (answer == 0) return rt::Status::timeout;
  if (answer < 0) return errno == EINTR ? rt::Status::skipped : lose();
  // A filled buffer counts more than the error behind it: it is still whole.
  if ((waited.revents & POLLIN) != 0) return rt::Status::skipped;
  return lose();
}

rt::Status LiveDevice::take(const Filled& filled) {
  const rt::HostTime dequeued = now();
  const FrameOrder::Number number = order_.next(filled.sequence);
  counters_.frames_missing += number.missing_count;
  const auto begin_ns = metadata_.capture_begin(filled.sequence);
  const auto driver_ns = stamp_ns(filled.stamp.tv_sec, filled.stamp.tv_usec);
  if (!driver_ns) {
    ++counters_.timestamps_rejected;
    say(number.sequence, "has a stamp that is no time");
    (void)give_back(filled.index);
    return rt::Status::skipped;
  }
  // A stamp at the end of the frame is when the kernel had it; one from before it came is not. Drivers that work the end
  // out by the frame rate (vivid) may say a time that is still to come.
  const bool is_stamped_at_end =
      has_host_clock_ && (filled.flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) == V4L2_BUF_FLAG_TSTAMP_SRC_EOF;
  const rt::HostTime arrived = is_stamped_at_end ? std::min(rt::HostTime{*driver_ns}, dequeued) : dequeued;

  if ((filled.flags & V4L2_BUF_FLAG_ERROR) != 0)
    return reject(filled, number.sequence, "is flagged as damaged by the driver");
  // A driver that does not stamp leaves 0.
  const std::int64_t device_ns =
      *driver_ns == 0 && !has_host_clock_ ? arrived.ns : capture_clock_.at(*driver_ns, begin_ns);
  const rt::SensorTime time = clock_.at(device_ns, arrived, has_host_clock_);
  frame_ = {{time, number.sequence, arrived}, agreement_.pixel_format, agreement_.width, agreement_.height,
            agreement_.row_bytes, filled.bytes};
  if (!frames::is_whole(frame_)) return reject(filled, number.sequence, "is shorter than its size");
  if (has_last_time_ && time <= last_time_) {
    ++counters_.timestamps_rejected;
    say(number.sequence, "is not later than the frame before");
    (void)give_back(filled.index);
    return rt::Status::skipped;
  }
  last_time_ = time;
  has_last_time_ = true;
  held_index_ = filled.index;
  is_held_ = true;
  return rt::Status::ok;
}

void LiveDevice::release(rt::Status outcome) {
  if (!is_held_) return;
  is_held_ = false;
  if (outcome == rt::Status::ok) {
    ++counters_.frames_delivered;
  } else {
    ++counters_.frames_rejected;
    say(frame_.header.sequence, "does not decode");
  }
  (void)give_back(held_index_);
}

rt::Status LiveDevice::reject(const Filled& filled, std::uint64_t sequence, const char* why) {
  ++counters_.frames_rejected;
  say(sequence, why);
  (void)give_back(filled.index);
  return rt::Status::corrupt;
}

void LiveDevice::say(std::uint64_t sequence, const char* why) {
  if (!counters_.first_rejection.empty()) return;
  std::array<char, frames::kSentenceBytes> sentence;
  std::snprintf(sentence.data(), sentence.size(), "%s: frame %llu %s", path_.data(),
                static_cast<unsigned long long>(sequence), why);
  counters_.first_rejection.assign(sentence.data());
}

bool LiveDevice::give_back(std::uint32_t index) noexcept {
  if (buffers_.queue(node_.get(), index) == 0) return true;
  refused_ |= 1U << index;
  return false;
}

bool LiveDevice::give_back_refused() noexcept {
  std::uint32_t refused_count = 0;
  for (std::uint32_t i = 0; i < buffers_.count() && refused_ != 0; ++i) {
    if ((refused_ & 1U << i) == 0) continue;
    refused_ &= ~(1U << i);
    if (!give_back(i)) ++refused_count;
  }
  return refused_count < buffers_.count();
}

/// The driver filled its buffers when the stream started and had none for the frames since: those frames are before the
/// session, and the gap behind them is no loss.
void LiveDevice::pass_over_stale_frames() noexcept {
  Filled filled;
  for (std::uint32_t i = 0; i < buffers_.count() && buffers_.dequeue(node_.get(), filled) == 0; ++i)
    (void)give_back(filled.index);
}

rt::Status LiveDevice::lose() noexcept {
  metadata_.stop();
  buffers_.detach();
  node_.close();
  ++counters_.losses;
  next_look_ = now() + kLookEvery;
  return rt::Status::device_lost;
}

rt::Status LiveDevice::look_again(rt::HostTime deadline) {
  const rt::Clock clock = rt::Clock::monotonic();
  if (clock.now() < next_look_) clock.sleep_until(std::min(next_look_, deadline));
  if (clock.now() < next_look_) return rt::Status::device_lost;
  next_look_ = clock.now() + kLookEvery;
  if (!open_again()) {
    metadata_.stop();
    buffers_.detach();
    node_.close();
    return rt::Status::device_lost;
  }
  order_.restart();
  clock_.restart();
  return rt::Status::ok;
}

bool LiveDevice::open_again() noexcept {
  node_ = find_node(info_, &NodeInfo::is_capture, path_);
  NodeInfo found;
  if (!node_.is_open() || read_info(node_.get(), found) != 0 || found.card != info_.card) return false;
  if (!restore(node_.get(), agreement_)) return false;
  for (const ControlValue& control : controls_) (void)set_control(node_.get(), control);
  start_metadata();
  const char* what = "";
  return buffers_.attach_again(node_.get()) && start_stream(what) == 0;
}

std::string LiveDevice::description() const {
  std::array<char, 32> rate;
  std::snprintf(rate.data(), rate.size(), "%.4g", agreement_.frame_rate_hz);
  return std::string("V4L2 ") + path_.data() + ": " + info_.card.data() + " (" + info_.driver.data() + ", " +
         info_.bus_info.data() + "), " + fourcc_text(agreement_.fourcc()) + " " + std::to_string(agreement_.width) + "x" +
         std::to_string(agreement_.height) + " " + rate.data() + " Hz, " + buffers_.description();
}

std::string LiveDevice::time_note() const {
  if (!has_host_clock_) return "the driver's times are on a clock of their own, not on this machine's monotonic clock";
  if (metadata_.is_running())
    return "times are the begin of each exposure by the camera's own clock, brought to the monotonic clock by its UVC "
           "metadata, or the kernel's while it sends none";
  if ((buffers_.stamp_flags() & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) == V4L2_BUF_FLAG_TSTAMP_SRC_SOE)
    return "times are the kernel's for the start of each exposure, on the monotonic clock";
  return "times are the kernel's for the end of each frame, on the monotonic clock; the exposure was before";
}

}  // namespace tactus::hal::v4l2
