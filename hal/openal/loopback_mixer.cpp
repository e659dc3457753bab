#include "hal/openal/loopback_mixer.hpp"

#include <AL/al.h>
#include <AL/alc.h>
#include <AL/alext.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "hal/openal/thread_context.hpp"

namespace tactus::hal::openal {
namespace {

constexpr int kRateHz = 48000;
constexpr float kNearestM = 0.2F;
// OpenAL holds a source's gain at 1 after its fall with distance and before the listener's: with this factor
// on the listener a clip of gain 1 is 1 / d down to 0.2 m.
constexpr float kListenerGain = 1 / kNearestM;
// A head's impulse response is shorter than 128 samples and starts up to 64 late: what a clip leaves in it is
// still heard.
constexpr std::size_t kTailSamples = 256;
constexpr std::size_t kClipSamplesMax = 4 * kRateHz;
constexpr float kKnee = 0.8F;

rt::Error unavailable(const std::string& what) {
  return {rt::ExitCode::device_unavailable,
          "no sound can be mixed on this machine: " + what +
              "; install libopenal1 (OpenAL Soft 1.19 or newer), or run without sound"};
}

struct Voice {
  ALuint source = 0;
  ALuint buffer = 0;
  std::size_t sample_frames_left = 0;  // 0: free
};

// |x| above the knee approaches 1 with a continuous slope.
float limited(float x) {
  const float over = (std::abs(x) - kKnee) / (1 - kKnee);
  return std::copysign(kKnee + (1 - kKnee) * over / (1 + over), x);
}

}  // namespace

struct LoopbackMixer::State {
  ALCdevice* device = nullptr;
  ALCcontext* context = nullptr;
  LPALCRENDERSAMPLESSOFT render = nullptr;
  bool has_hrtf = false;
  std::vector<Voice> voices;
  std::vector<float> padded;  // zeros of the delay, the clip, zeros of the tail
  int voices_free = 0;
  std::uint64_t clips_left_out = 0;
  std::uint64_t samples_limited = 0;

  State() = default;
  State(const State&) = delete;
  State& operator=(const State&) = delete;
  ~State() {
    if (context != nullptr) {
      {
        const ThreadContext current(context);
        for (const Voice& voice : voices) {
          if (voice.source != 0) alDeleteSources(1, &voice.source);
          if (voice.buffer != 0) alDeleteBuffers(1, &voice.buffer);
        }
      }
      alcDestroyContext(context);
    }
    if (device != nullptr) alcCloseDevice(device);
  }
};

rt::Result<LoopbackMixer> LoopbackMixer::create(const LoopbackConfig& config) {
  if (config.voices_count < 1 || config.voices_count > 256)
    return rt::Error{rt::ExitCode::bad_usage, "a mixer of " + std::to_string(config.voices_count) +
                                                  " voices cannot be made; give it 1 to 256"};
  if (!has_thread_contexts()) return unavailable("OpenAL has no context per thread");
  if (alcIsExtensionPresent(nullptr, "ALC_SOFT_loopback") != ALC_TRUE)
    return unavailable("OpenAL cannot mix into memory (ALC_SOFT_loopback)");
  const auto open =
      reinterpret_cast<LPALCLOOPBACKOPENDEVICESOFT>(alcGetProcAddress(nullptr, "alcLoopbackOpenDeviceSOFT"));
  const auto is_supported = reinterpret_cast<LPALCISRENDERFORMATSUPPORTEDSOFT>(
      alcGetProcAddress(nullptr, "alcIsRenderFormatSupportedSOFT"));
  auto state = std::make_unique<State>();
  state->render =
      reinterpret_cast<LPALCRENDERSAMPLESSOFT>(alcGetProcAddress(nullptr, "alcRenderSamplesSOFT"));
  if (open == nullptr || is_supported == nullptr || state->render == nullptr)
    return unavailable("OpenAL lacks the functions of its loopback device");
  state->device = open(nullptr);
  if (state->device == nullptr ||
      is_supported(state->device, kRateHz, ALC_STEREO_SOFT, ALC_FLOAT_SOFT) != ALC_TRUE)
    return unavailable("OpenAL's loopback device does not give 48 kHz stereo");

  const bool knows_hrtf = alcIsExtensionPresent(state->device, "ALC_SOFT_HRTF") == ALC_TRUE;
  // The library's own limiter looks ahead, which would move every sample; ours in mix() does not.
  std::vector<ALCint> attributes = {ALC_FORMAT_CHANNELS_SOFT,
                                    ALC_STEREO_SOFT,
                                    ALC_FORMAT_TYPE_SOFT,
                                    ALC_FLOAT_SOFT,
                                    ALC_FREQUENCY,
                                    kRateHz,
                                    ALC_MONO_SOURCES,
                                    config.voices_count,
                                    ALC_OUTPUT_LIMITER_SOFT,
                                    ALC_FALSE};
  if (knows_hrtf)
    attributes.insert(attributes.end(), {ALC_HRTF_SOFT, config.use_hrtf ? ALC_TRUE : ALC_FALSE});
  attributes.push_back(0);
  state->context = alcCreateContext(state->device, attributes.data());
  if (state->context == nullptr) return unavailable("OpenAL refuses a context on its loopback device");
  ALCint hrtf = ALC_FALSE;
  if (knows_hrtf) alcGetIntegerv(state->device, ALC_HRTF_SOFT, 1, &hrtf);
  state->has_hrtf = hrtf == ALC_TRUE;

  const ThreadContext current(state->context);
  alGetError();
  alDistanceModel(AL_INVERSE_DISTANCE_CLAMPED);
  alDopplerFactor(0);
  alListenerf(AL_GAIN, kListenerGain);
  state->voices.resize(static_cast<std::size_t>(config.voices_count));
  for (Voice& voice : state->voices) {
    alGenSources(1, &voice.source);
    alGenBuffers(1, &voice.buffer);
    alSourcef(voice.source, AL_REFERENCE_DISTANCE, kNearestM);
    alSourcef(voice.source, AL_ROLLOFF_FACTOR, 1);
  }
  if (alIsExtensionPresent("AL_EXT_FLOAT32") != AL_TRUE || alGetError() != AL_NO_ERROR)
    return unavailable("OpenAL does not give " + std::to_string(config.voices_count) +
                       " voices of float samples");
  state->voices_free = config.voices_count;
  LoopbackMixer mixer(std::move(state));
  mixer.set_listener({});
  return mixer;
}

LoopbackMixer::LoopbackMixer(std::unique_ptr<State> state) : state_(std::move(state)) {}
LoopbackMixer::LoopbackMixer(LoopbackMixer&&) noexcept = default;
LoopbackMixer::~LoopbackMixer() = default;

// OpenAL's axes are the world's (right-handed, y up when the head is level); a head looks along its z, its
// top is -y.
void LoopbackMixer::set_listener(const T_WorldDepth& T_world_listener) noexcept {
  if (!T_world_listener.is_finite()) return;
  const Vec3f at = (T_world_listener.rotation * Vec3d{0, 0, 1}).cast<float>();
  const Vec3f up = (T_world_listener.rotation * Vec3d{0, -1, 0}).cast<float>();
  const Vec3f place = T_world_listener.translation.cast<float>();
  const ALfloat orientation[] = {at.x, at.y, at.z, up.x, up.y, up.z};
  const ThreadContext current(state_->context);
  alListener3f(AL_POSITION, place.x, place.y, place.z);
  alListenerfv(AL_ORIENTATION, orientation);
}

rt::Status LoopbackMixer::play(const SpatialClip& clip) noexcept {
  State& s = *state_;
  const Vec3f place = clip.position_world_m.cast<float>();
  const std::int64_t wait =
      clip.delay.ns <= 0 ? 0 : static_cast<std::int64_t>(std::llround(clip.delay.seconds() * kRateHz));
  if (clip.samples.empty() || !std::isfinite(place.x + place.y + place.z) || !std::isfinite(clip.gain) ||
      clip.gain < 0 || wait > static_cast<std::int64_t>(kClipSamplesMax) ||
      clip.samples.size() > kClipSamplesMax)
    return rt::Status::unsupported;
  const auto voice = std::find_if(s.voices.begin(), s.voices.end(),
                                  [](const Voice& v) { return v.sample_frames_left == 0; });
  if (voice == s.voices.end()) {
    ++s.clips_left_out;
    return rt::Status::full;
  }
  s.padded.assign(static_cast<std::size_t>(wait), 0.0F);
  s.padded.insert(s.padded.end(), clip.samples.begin(), clip.samples.end());
  s.padded.resize(s.padded.size() + kTailSamples, 0.0F);

  const ThreadContext current(s.context);
  alGetError();
  alSourceStop(voice->source);
  alSourcei(voice->source, AL_BUFFER, 0);
  alBufferData(voice->buffer, AL_FORMAT_MONO_FLOAT32, s.padded.data(),
               static_cast<ALsizei>(s.padded.size() * sizeof(float)), kRateHz);
  alSourcei(voice->source, AL_BUFFER, static_cast<ALint>(voice->buffer));
  alSource3f(voice->source, AL_POSITION, place.x, place.y, place.z);
  alSourcef(voice->source, AL_GAIN, clip.gain);
  alSourcePlay(voice->source);
  if (alGetError() != AL_NO_ERROR) {
    ++s.clips_left_out;
    return rt::Status::full;
  }
  voice->sample_frames_left = s.padded.size();
  --s.voices_free;
  return rt::Status::ok;
}

rt::Status LoopbackMixer::mix(std::span<float> samples) noexcept {
  State& s = *state_;
  TACTUS_ASSERT(samples.size() % 2 == 0);
  const std::size_t sample_frames = samples.size() / 2;
  alcGetError(s.device);
  s.render(s.device, samples.data(), static_cast<ALCsizei>(sample_frames));
  if (alcGetError(s.device) != ALC_NO_ERROR) {
    std::fill(samples.begin(), samples.end(), 0.0F);
    return rt::Status::device_lost;
  }
  for (Voice& voice : s.voices) {
    if (voice.sample_frames_left == 0) continue;
    voice.sample_frames_left -= std::min(voice.sample_frames_left, sample_frames);
    if (voice.sample_frames_left == 0) ++s.voices_free;
  }
  for (float& x : samples) {
    if (std::abs(x) <= kKnee) continue;
    x = limited(x);
    ++s.samples_limited;
  }
  return rt::Status::ok;
}

int LoopbackMixer::voices_free() const noexcept { return state_->voices_free; }
std::uint64_t LoopbackMixer::clips_left_out() const { return state_->clips_left_out; }
bool LoopbackMixer::has_hrtf() const { return state_->has_hrtf; }
std::uint64_t LoopbackMixer::samples_limited() const { return state_->samples_limited; }

}  // namespace tactus::hal::openal
