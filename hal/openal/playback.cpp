#include "hal/openal/playback.hpp"

#include <AL/al.h>
#include <AL/alc.h>
#include <AL/alext.h>
#include <dlfcn.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "hal/openal/thread_context.hpp"

namespace tactus::hal::openal {
namespace {

constexpr int kRateHz = 48000;

rt::Error unavailable(const std::string& what) {
  return {rt::ExitCode::device_unavailable, "no sound can be played on this machine: " + what +
                                                "; connect a sound card, or write the sound to a file"};
}

// A machine without a sound card makes ALSA print eight lines of its configuration language on stderr. OpenAL
// has loaded ALSA if it uses it; where it has not there is nothing to silence. Variadic, as ALSA declares it.
void say_nothing(const char*, int, const char*, int, const char*, ...) {}

void silence_alsa() {
  void* alsa = dlopen("libasound.so.2", RTLD_NOW | RTLD_NOLOAD);
  if (alsa == nullptr) return;
  using Handler = void (*)(const char*, int, const char*, int, const char*, ...);
  using SetHandler = int (*)(Handler);
  const auto set_handler = reinterpret_cast<SetHandler>(dlsym(alsa, "snd_lib_error_set_handler"));
  if (set_handler != nullptr) set_handler(say_nothing);
  dlclose(alsa);
}

}  // namespace

struct Playback::State {
  PlaybackConfig config;
  ALCdevice* device = nullptr;
  ALCcontext* context = nullptr;
  ALuint source = 0;
  std::vector<ALuint> buffers;
  std::vector<ALuint> free_buffers;
  bool reports_disconnection = false;
  bool has_begun = false;
  bool is_lost = false;
  std::uint64_t sample_frames_written = 0;
  std::uint64_t underruns = 0;

  State() = default;
  State(const State&) = delete;
  State& operator=(const State&) = delete;
  ~State() {
    if (context != nullptr) {
      {
        const ThreadContext current(context);
        if (source != 0) {
          alSourceStop(source);
          alSourcei(source, AL_BUFFER, 0);
          alDeleteSources(1, &source);
        }
        if (!buffers.empty()) alDeleteBuffers(static_cast<ALsizei>(buffers.size()), buffers.data());
      }
      alcDestroyContext(context);
    }
    if (device != nullptr) alcCloseDevice(device);
  }

  void take_back_played() {
    ALint played = 0;
    alGetSourcei(source, AL_BUFFERS_PROCESSED, &played);
    for (; played > 0; --played) {
      ALuint buffer = 0;
      alSourceUnqueueBuffers(source, 1, &buffer);
      if (alGetError() != AL_NO_ERROR) return;
      free_buffers.push_back(buffer);
    }
  }
};

rt::Result<Playback> Playback::create(const PlaybackConfig& config) {
  if (config.buffers_count < 2 || config.buffer_frames < 1 || config.buffers_before_start < 1 ||
      config.buffers_before_start > config.buffers_count)
    return rt::Error{rt::ExitCode::bad_usage,
                     "a queue of " + std::to_string(config.buffers_count) +
                         " sound buffers that begins with " + std::to_string(config.buffers_before_start) +
                         " cannot be made; give it 2 or more, and begin with 1 of them or more"};
  if (!has_thread_contexts()) return unavailable("OpenAL has no context per thread");
  silence_alsa();
  auto state = std::make_unique<State>();
  state->config = config;
  state->device = alcOpenDevice(nullptr);
  if (state->device == nullptr) return unavailable("OpenAL finds no device to play on");
  const ALCint attributes[] = {ALC_FREQUENCY, kRateHz, ALC_REFRESH, kRateHz / config.buffer_frames, 0};
  state->context = alcCreateContext(state->device, attributes);
  if (state->context == nullptr) return unavailable("OpenAL refuses a context on the default device");
  state->reports_disconnection = alcIsExtensionPresent(state->device, "ALC_EXT_disconnect") == ALC_TRUE;

  const ThreadContext current(state->context);
  alGetError();
  alGenSources(1, &state->source);
  state->buffers.resize(static_cast<std::size_t>(config.buffers_count));
  alGenBuffers(config.buffers_count, state->buffers.data());
  if (alIsExtensionPresent("AL_EXT_FLOAT32") != AL_TRUE || alGetError() != AL_NO_ERROR)
    return unavailable("OpenAL does not give a stream of float samples");
  state->free_buffers = state->buffers;
  return Playback(std::move(state));
}

Playback::Playback(std::unique_ptr<State> state) : state_(std::move(state)) {}
Playback::Playback(Playback&&) noexcept = default;
Playback::~Playback() = default;

rt::Status Playback::write(std::span<const float> samples) noexcept {
  State& s = *state_;
  TACTUS_ASSERT(samples.size() % 2 == 0);
  if (s.reports_disconnection && !s.is_lost) {
    ALCint is_connected = ALC_TRUE;
    alcGetIntegerv(s.device, ALC_CONNECTED, 1, &is_connected);
    s.is_lost = is_connected == ALC_FALSE;
  }
  if (s.is_lost) return rt::Status::device_lost;
  const std::size_t buffer_samples = 2 * static_cast<std::size_t>(s.config.buffer_frames);
  const std::size_t buffers_wanted = (samples.size() + buffer_samples - 1) / buffer_samples;
  if (buffers_wanted > s.buffers.size()) return rt::Status::unsupported;

  const ThreadContext current(s.context);
  alGetError();
  s.take_back_played();
  if (buffers_wanted > s.free_buffers.size()) return rt::Status::full;
  for (std::span<const float> rest = samples; !rest.empty();) {
    const std::span<const float> piece = rest.first(std::min(rest.size(), buffer_samples));
    rest = rest.subspan(piece.size());
    const ALuint buffer = s.free_buffers.back();
    alBufferData(buffer, AL_FORMAT_STEREO_FLOAT32, piece.data(), static_cast<ALsizei>(piece.size_bytes()),
                 kRateHz);
    alSourceQueueBuffers(s.source, 1, &buffer);
    if (alGetError() != AL_NO_ERROR) {
      s.is_lost = true;
      return rt::Status::device_lost;
    }
    s.free_buffers.pop_back();
  }
  s.sample_frames_written += samples.size() / 2;

  ALint source_state = AL_INITIAL;
  alGetSourcei(s.source, AL_SOURCE_STATE, &source_state);
  if (source_state == AL_PLAYING) return rt::Status::ok;
  if (s.has_begun) ++s.underruns;
  s.has_begun = false;
  // A source that ran dry counts all that is queued as played until it is rewound.
  alSourceRewind(s.source);
  if (s.buffers.size() - s.free_buffers.size() < static_cast<std::size_t>(s.config.buffers_before_start))
    return rt::Status::ok;
  alSourcePlay(s.source);
  s.has_begun = true;
  return rt::Status::ok;
}

std::uint64_t Playback::sample_frames_written() const { return state_->sample_frames_written; }
std::uint64_t Playback::underruns() const { return state_->underruns; }

}  // namespace tactus::hal::openal
