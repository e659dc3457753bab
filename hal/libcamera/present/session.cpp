#include "hal/libcamera/present/session.hpp"

#include <linux/dma-buf.h>
#include <sys/ioctl.h>
#include <sys/mman.h>

#include <algorithm>
#include <cerrno>
#include <system_error>

#include "rt/clock.hpp"

namespace tactus::hal::libcamera {
namespace {

std::string words_of(int error) { return std::generic_category().message(error < 0 ? -error : error); }

void sync(int fd, std::uint64_t flags) noexcept {
  dma_buf_sync request{flags | DMA_BUF_SYNC_READ};
  (void)ioctl(fd, DMA_BUF_IOCTL_SYNC, &request);  // an exporter that knows nothing of caches needs none
}

}  // namespace

std::string acquire(lc::Camera& camera) {
  const int error = camera.acquire();
  if (error == 0) return {};
  if (error == -EBUSY) return "is in use by another program, or opened twice; close the other one";
  return "cannot be acquired: " + words_of(error);
}

Session::Session(std::shared_ptr<lc::Camera> camera, Wake& wake)
    : camera_(std::move(camera)), wake_(wake), producer_(ring_.producer()), consumer_(ring_.consumer()) {
  camera_->requestCompleted.connect(this, &Session::on_completed);
  camera_->disconnected.connect(this, &Session::on_disconnected);
}

rt::Result<std::unique_ptr<Session>> Session::open(std::shared_ptr<lc::Camera> camera, const Mode& mode, Wake& wake) {
  std::unique_ptr<Session> session(new Session(std::move(camera), wake));
  std::string why_not = session->configure(mode.choice);
  if (why_not.empty()) why_not = session->make_requests();
  if (why_not.empty()) why_not = session->start(mode.controls);
  if (!why_not.empty())
    return rt::Error{rt::ExitCode::device_unavailable, "libcamera:" + session->camera_->id() + ": " + why_not + "."};
  return session;
}

Session::~Session() {
  is_closing_ = true;
  // libcamera 0.0.3 ends the program when it is told to stop a device that answers no more and of which it has not yet
  // heard that it is gone; it then keeps the camera until its manager goes.
  const bool is_unheard_of = is_lost() && !is_disconnected_;
  if (is_acquired_ && !is_unheard_of) camera_->stop();
  camera_->requestCompleted.disconnect(this);
  camera_->disconnected.disconnect(this);
  for (Slot& slot : slots_) {
    slot.request.reset();
    if (slot.mapping != nullptr) munmap(slot.mapping, slot.mapping_bytes);
  }
  allocator_.reset();
  if (is_acquired_) camera_->release();
}

std::string Session::configure(const FormatChoice& choice) {
  std::string why_not = acquire(*camera_);
  if (!why_not.empty()) return why_not;
  is_acquired_ = true;
  const auto configuration = camera_->generateConfiguration({lc::StreamRole::Viewfinder});
  if (!configuration || configuration->empty()) return "has no stream for pictures";
  lc::StreamConfiguration& stream = configuration->at(0);
  stream.pixelFormat = choice.theirs;
  stream.size = choice.size;
  const bool is_valid = configuration->validate() != lc::CameraConfiguration::Invalid;
  if (!is_valid || stream.pixelFormat != choice.theirs || stream.size != choice.size)
    return "offers " + choice.theirs.toString() + " " + choice.size.toString() +
           " but does not take it; ask for another mode";
  const int error = camera_->configure(configuration.get());
  if (error != 0) return "does not take its mode: " + words_of(error);
  stream_ = stream.stream();
  format_ = choice.ours;
  width_ = static_cast<int>(choice.size.width);
  height_ = static_cast<int>(choice.size.height);
  row_bytes_ = format_ == PixelFormat::mjpeg ? 0 : stream.stride;
  return {};
}

std::string Session::make_requests() {
  allocator_ = std::make_unique<lc::FrameBufferAllocator>(camera_);
  const int count = allocator_->allocate(stream_);
  if (count < 0) return "gives no buffers: " + words_of(count);
  for (const std::unique_ptr<lc::FrameBuffer>& buffer : allocator_->buffers(stream_)) {
    Slot& slot = slots_.emplace_back();
    std::string why_not = map(*buffer, slot);
    if (!why_not.empty()) return why_not;
    slot.request = camera_->createRequest(slots_.size() - 1);
    if (!slot.request || slot.request->addBuffer(stream_, buffer.get()) != 0) return "gives no requests";
  }
  // One waiting, one being read, two with the device: with fewer it loses frames while the reader works.
  if (slots_.size() < 4) return "has only " + std::to_string(slots_.size()) + " buffers, and 4 are needed";
  return {};
}

std::string Session::map(const lc::FrameBuffer& buffer, Slot& slot) const {
  const std::vector<lc::FrameBuffer::Plane>& planes = buffer.planes();
  const auto at = [](const lc::FrameBuffer::Plane& plane) {
    return plane.offset == lc::FrameBuffer::Plane::kInvalidOffset ? 0U : plane.offset;
  };
  for (std::size_t i = 1; i < planes.size(); ++i)
    if (planes[i].fd.get() != planes[0].fd.get() || at(planes[i]) != at(planes[i - 1]) + planes[i - 1].length)
      return "keeps the planes of a picture apart; ask for another format";
  if (planes.size() == 2 && planes[0].length != row_bytes_ * static_cast<std::size_t>(height_))
    return "pads the planes of a picture; ask for another format";
  slot.fd = planes[0].fd.get();
  slot.offset = at(planes[0]);
  slot.mapping_bytes = std::size_t{at(planes.back())} + planes.back().length;
  slot.frame_bytes = slot.mapping_bytes - slot.offset;
  void* mapping = mmap(nullptr, slot.mapping_bytes, PROT_READ, MAP_SHARED, slot.fd, 0);
  if (mapping == MAP_FAILED) return "its buffers cannot be mapped: " + words_of(errno);
  slot.mapping = mapping;
  return {};
}

std::string Session::start(const std::vector<ControlSetting>& controls) {
  lc::ControlList list(camera_->controls());
  for (const ControlSetting& setting : controls) {
    list.set(setting.id, setting.value);
    slots_.front().request->controls().set(setting.id, setting.value);
  }
  const int error = camera_->start(&list);
  if (error != 0) return "does not start: " + words_of(error);
  for (const Slot& slot : slots_) {
    const int refused = camera_->queueRequest(slot.request.get());
    if (refused != 0) return "takes no requests: " + words_of(refused);
  }
  return {};
}

void Session::on_completed(lc::Request* request) {
  const auto index = static_cast<std::uint32_t>(request->cookie());
  const bool is_first = controls_.load(std::memory_order_relaxed) == Controls::pending && index == 0;
  const bool is_cancelled = request->status() == lc::Request::RequestCancelled;
  if (is_closing_) return;
  // Pairs with the acquire in controls_taken(). Relaxed above: this thread alone writes it.
  if (is_first) controls_.store(is_cancelled ? Controls::refused : Controls::taken, std::memory_order_release);
  if (is_cancelled) {
    if (!is_first) return lose();
    give_back(index);  // without its controls now
    return wake_.notify();
  }
  Frame& frame = slots_[index].frame;
  const lc::FrameMetadata& metadata = request->findBuffer(stream_)->metadata();
  frame.is_good = metadata.status == lc::FrameMetadata::FrameSuccess;
  frame.sequence = metadata.sequence;
  frame.time = {static_cast<std::int64_t>(metadata.timestamp)};
  frame.arrived = rt::Clock::monotonic().now();
  frame.used_bytes = 0;
  for (const lc::FrameMetadata::Plane& plane : metadata.planes()) frame.used_bytes += plane.bytesused;
  if (const std::optional<std::uint32_t> oldest = producer_.push(index)) give_back(*oldest);
  wake_.notify();
}

void Session::on_disconnected() {
  is_disconnected_ = true;
  lose();
}

void Session::lose() noexcept {
  is_lost_.store(true, std::memory_order_release);
  wake_.notify();
}

std::optional<bool> Session::controls_taken() const noexcept {
  const Controls controls = controls_.load(std::memory_order_acquire);
  if (controls == Controls::pending) return std::nullopt;
  return controls == Controls::taken;
}

RawFrame Session::raw(std::uint32_t index) const {
  const Slot& slot = slots_[index];
  const auto* bytes = static_cast<const std::uint8_t*>(slot.mapping) + slot.offset;
  return {{}, format_, width_, height_, row_bytes_, {bytes, std::min(slot.frame.used_bytes, slot.frame_bytes)}};
}

void Session::begin_access(std::uint32_t index) const noexcept { sync(slots_[index].fd, DMA_BUF_SYNC_START); }
void Session::end_access(std::uint32_t index) const noexcept { sync(slots_[index].fd, DMA_BUF_SYNC_END); }

void Session::give_back(std::uint32_t index) {
  lc::Request* request = slots_[index].request.get();
  request->reuse(lc::Request::ReuseBuffers);
  if (camera_->queueRequest(request) != 0) lose();
}

std::size_t Session::buffers_bytes() const {
  std::size_t bytes = 0;
  for (const Slot& slot : slots_) bytes += slot.mapping_bytes;
  return bytes;
}

}  // namespace tactus::hal::libcamera
