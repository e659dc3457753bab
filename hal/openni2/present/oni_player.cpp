#include "hal/openni2/present/oni_player.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <chrono>
#include <cstring>
#include <thread>

#include "rt/clock.hpp"
#include "rt/heap_guard.hpp"

namespace tactus::hal::openni2 {
namespace {

constexpr const char* kUriPrefix = "/proc/self/fd/";
constexpr rt::Duration kPatience{5'000'000'000};
// The library's thread serves live devices too, and gives one look at a file no longer than one of their frames lasts.
constexpr int kLook_ms = 30;

}  // namespace

bool is_recording_uri(const char* uri) { return std::strncmp(uri, kUriPrefix, std::strlen(kUriPrefix)) == 0; }

void* OniPlayer::Gate::take(std::size_t bytes) {
  {
    std::unique_lock lock(mutex_);
    opened_.wait(lock, [this] { return is_closing_ || !is_frame_untaken_; });
    is_frame_untaken_ = true;
  }
  // Never null, not even while closing: the player then keeps a lock for ever.
  return buffers.take(bytes);
}

void OniPlayer::Gate::open_once() {
  {
    const std::lock_guard lock(mutex_);
    is_frame_untaken_ = false;
  }
  opened_.notify_one();
}

void OniPlayer::Gate::open_for_good() {
  {
    const std::lock_guard lock(mutex_);
    is_closing_ = true;
  }
  opened_.notify_one();
}

OniPlayer::OniPlayer(Library& library, int file, std::size_t frame_bytes)
    : library_(library), file_(file), gate_(frame_bytes) {}

rt::Result<std::unique_ptr<OniPlayer>> OniPlayer::open(const std::filesystem::path& file, OniSensorType sensor,
                                                       std::size_t frame_bytes) {
  auto library = Library::get();
  if (!library) return library.error();
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return rt::Error{rt::ExitCode::bad_input, file.string() + ": cannot be read."};
  std::unique_ptr<OniPlayer> player(new OniPlayer(**library, descriptor, frame_bytes));
  if (auto started = player->start(sensor, file.string()); !started) return started.error();
  return player;
}

rt::Result<void> OniPlayer::start(OniSensorType sensor, const std::string& name) {
  // The library knows a device by its URI, which it cuts after 255 bytes: one of ours is short, and no two players share it.
  const std::string uri = kUriPrefix + std::to_string(file_);
  std::string words;
  bool has_started = false;
  library_.call([&] {
    has_started = start_stream(uri, sensor);
    if (!has_started) words = last_words();
  });
  if (has_started) return {};
  return rt::Error{rt::ExitCode::bad_input,
                   name + ": OpenNI2 does not play it" + (words.empty() ? "" : ": " + words) + "."};
}

bool OniPlayer::start_stream(const std::string& uri, OniSensorType sensor) {
  if (oniDeviceOpen(uri.c_str(), &device_) != ONI_STATUS_OK) {
    device_ = nullptr;
    return false;
  }
  const float speed = -1;  // a frame whenever one is asked for
  const OniBool repeats = FALSE;
  if (oniDeviceSetProperty(device_, ONI_DEVICE_PROPERTY_PLAYBACK_SPEED, &speed, sizeof speed) != ONI_STATUS_OK ||
      oniDeviceSetProperty(device_, ONI_DEVICE_PROPERTY_PLAYBACK_REPEAT_ENABLED, &repeats, sizeof repeats) !=
          ONI_STATUS_OK ||
      oniDeviceCreateStream(device_, sensor, &stream_) != ONI_STATUS_OK)
    return false;
  (void)oniStreamSetFrameBuffersAllocator(
      stream_, [](int bytes, void* gate) { return static_cast<Gate*>(gate)->take(static_cast<std::size_t>(bytes)); },
      [](void* buffer, void* gate) { static_cast<Gate*>(gate)->buffers.give_back(buffer); }, &gate_);
  return oniStreamStart(stream_) == ONI_STATUS_OK;
}

const OniFrame* OniPlayer::next() {
  const rt::HostTime end = rt::Clock::monotonic().now() + kPatience;
  do {
    library_.call([this] {
      const rt::GuestScope guest;
      if (frame_ != nullptr) oniFrameRelease(frame_);
      frame_ = nullptr;
      int index = 0;
      if (oniWaitForAnyStream(&stream_, 1, &index, kLook_ms) == ONI_STATUS_OK) (void)oniStreamReadFrame(stream_, &frame_);
    });
    if (frame_ != nullptr) {
      gate_.open_once();
      return frame_;
    }
  } while (rt::Clock::monotonic().now() < end);
  return nullptr;
}

OniPlayer::~OniPlayer() {
  gate_.open_for_good();
  library_.call([this] {
    if (frame_ != nullptr) oniFrameRelease(frame_);
    if (stream_ != nullptr) {
      oniStreamStop(stream_);
      // At the file's end the player's thread walks the list of streams without a pause and without a lock; once none is
      // started it rests 10 ms between two looks. Only then is the stream taken out of that list.
      std::this_thread::sleep_for(std::chrono::milliseconds(15));
      oniStreamDestroy(stream_);
    }
    if (device_ != nullptr) (void)oniDeviceClose(device_);
  });
  ::close(file_);
}

}  // namespace tactus::hal::openni2
