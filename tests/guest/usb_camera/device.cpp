#include "tests/guest/usb_camera/device.hpp"

#include <algorithm>
#include <utility>

namespace tactus::guest {
namespace {

std::uint32_t device_clock(rt::HostTime time) {
  return static_cast<std::uint32_t>(static_cast<std::uint64_t>(time.ns) * (kClock_hz / 1'000'000) / 1000);
}

std::uint16_t bus_frame(rt::HostTime time) { return static_cast<std::uint16_t>(time.ns / 1'000'000 & 0x7ff); }

}  // namespace

Device::Device(const CameraSpec& camera, std::shared_ptr<const Clip> clip, const PlayOptions& options)
    : camera_(camera), clip_(std::move(clip)), options_(options), control_(camera), streams_(camera.streams.size()) {}

bool Device::feed(std::span<const std::uint8_t> bytes, rt::HostTime now) {
  inbox_.insert(inbox_.end(), bytes.begin(), bytes.end());
  std::size_t taken = 0;
  while (inbox_.size() - taken >= usbip::kMessageBytes) {
    const auto rest = std::span<const std::uint8_t>(inbox_).subspan(taken);
    const auto message = usbip::parse(rest.first<usbip::kMessageBytes>());
    if (!message) return false;
    const auto* request = std::get_if<usbip::Submit>(&*message);
    const std::size_t data_bytes = request != nullptr && !request->is_in ? request->data_bytes : 0;
    if (rest.size() < usbip::kMessageBytes + data_bytes) break;
    if (request != nullptr)
      submit(*request, rest.subspan(usbip::kMessageBytes, data_bytes));
    else
      unlink(std::get<usbip::Unlink>(*message));
    taken += usbip::kMessageBytes + data_bytes;
  }
  inbox_.erase(inbox_.begin(), inbox_.begin() + static_cast<std::ptrdiff_t>(taken));
  (void)step(now);
  return true;
}

std::optional<rt::HostTime> Device::step(rt::HostTime now) {
  if (is_unplugged_) return std::nullopt;
  const auto is_on = [](const Stream& stream) { return stream.is_on; };
  if (!next_frame_ && std::any_of(streams_.begin(), streams_.end(), is_on)) next_frame_ = now;
  if (next_frame_ && now >= *next_frame_ && can_show()) show_frame(now);
  for (Stream& stream : streams_) send(stream, now);
  // A frame that is due but waits for the host goes on with the host's next message.
  if (!next_frame_ || !can_show()) return std::nullopt;
  return next_frame_;
}

Bytes Device::take_output() { return std::exchange(outbox_, {}); }
std::vector<ShownFrame> Device::take_shown() { return std::exchange(shown_, {}); }

void Device::submit(const usbip::Submit& request, std::span<const std::uint8_t> data) {
  if (request.endpoint == 0) return answer_control(request, data);
  for (std::size_t i = 0; i < streams_.size(); ++i) {
    if (request.endpoint == endpoint_of(i) && request.is_in) {
      streams_[i].waiting.push_back(request);
      return;
    }
  }
  put(usbip::submit_answer(request.number, usbip::kStalled, 0));
}

void Device::unlink(const usbip::Unlink& request) {
  std::int32_t status = 0;
  for (Stream& stream : streams_) {
    const auto is_meant = [&](const usbip::Submit& s) { return s.number == request.submit_number; };
    if (std::erase_if(stream.waiting, is_meant) > 0) status = usbip::kUnlinked;
  }
  put(usbip::unlink_answer(request.number, status));
}

void Device::answer_control(const usbip::Submit& request, std::span<const std::uint8_t> data) {
  const auto answer = control_.answer(request.setup, data);
  switch_streams();
  if (!answer) return put(usbip::submit_answer(request.number, usbip::kStalled, 0));
  if (request.is_in)
    put(usbip::submit_answer(request.number, 0, static_cast<std::uint32_t>(answer->size())), *answer);
  else
    put(usbip::submit_answer(request.number, 0, request.data_bytes));
}

void Device::put(const usbip::Message& message, std::span<const std::uint8_t> data) {
  outbox_.insert(outbox_.end(), message.begin(), message.end());
  outbox_.insert(outbox_.end(), data.begin(), data.end());
}

void Device::switch_streams() {
  if (const auto stream = control_.take_committed()) {
    streams_[*stream].is_on = true;
    interval_ = {static_cast<std::int64_t>(control_.frame_interval(*stream)) * 100};
  }
  if (const auto stream = control_.take_stopped()) {
    streams_[*stream].is_on = false;
    streams_[*stream].cutter.drop();
    if (std::none_of(streams_.begin(), streams_.end(), [](const Stream& s) { return s.is_on; })) {
      next_frame_.reset();
      frame_ = 0;
    }
  }
}

bool Device::can_show() const {
  return (options_.repeats || frame_ < clip_->frames_count()) &&
         std::none_of(streams_.begin(), streams_.end(), [](const Stream& s) { return s.is_on && s.cutter.is_sending(); });
}

void Device::show_frame(rt::HostTime now) {
  for (std::size_t i = 0; i < streams_.size(); ++i) {
    if (!streams_[i].is_on) continue;
    auto bytes = clip_->frame(camera_.streams[i].format, frame_ % clip_->frames_count());
    if (frame_ == options_.short_at) bytes = bytes.first(bytes.size() / 2);
    streams_[i].cutter.begin({bytes, device_clock(now), frame_ == options_.error_at});
  }
  shown_.push_back({frame_, now});
  ++frame_;
  // Who is late by a whole frame is late from then on, rather than in a hurry to catch up.
  next_frame_ = (now - *next_frame_ > interval_ ? now : *next_frame_) + interval_;
}

void Device::send(Stream& stream, rt::HostTime now) {
  const bool is_last_frame = options_.unplug_at != kNever && frame_ == options_.unplug_at + 1;
  while (stream.is_on && stream.cutter.is_sending() && !stream.waiting.empty() && !is_unplugged_) {
    const usbip::Submit request = stream.waiting.front();
    stream.waiting.pop_front();
    const std::size_t most = std::min(request.data_bytes, kPayloadBytes);
    const Bytes payload = stream.cutter.next(most, device_clock(now), bus_frame(now));
    put(usbip::submit_answer(request.number, 0, static_cast<std::uint32_t>(payload.size())), payload);
    is_unplugged_ = is_last_frame && stream.cutter.is_past_half();
  }
}

}  // namespace tactus::guest
