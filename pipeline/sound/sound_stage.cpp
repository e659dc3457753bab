#include "pipeline/sound/sound_stage.hpp"

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "pipeline/sound/impact_sound.hpp"

namespace tactus::sound {
namespace {

static_assert(std::is_trivially_copyable_v<Impact>);

constexpr std::int64_t kNsPerS = 1'000'000'000;
constexpr std::size_t kReflectionsMax = 8;
// A reflection is heard as a part of the first 50 ms; the rest of a long ring is masked by the sound itself,
// and its voice is better used by the next sound.
constexpr std::size_t kReflectedSamplesMax = kSampleRateHz * 3 / 10;
constexpr std::size_t kReflectedFadeSamples = kSampleRateHz / 20;
constexpr double kNearestM = 0.2;  // as the mixer's

double energy_of(const Impact& impact) {
  return std::max(impact.energy_j, 0.5 * impact.impulse_n_s * impact.impact_speed_m_per_s);
}

Strike strike_of(const Impact& impact, std::uint32_t seed) {
  Strike strike;
  strike.body_material = impact.body_material;
  strike.surface_material = impact.surface_material;
  strike.body_size_m = impact.body_size_m;
  strike.surface_size_m = impact.surface_size_m;
  strike.energy_j = impact.energy_j;
  strike.impulse_n_s = impact.impulse_n_s;
  strike.speed_m_per_s = impact.impact_speed_m_per_s;
  strike.seed = seed;
  return strike;
}

double amplitude_of(const StrikeSpectrum& spectrum) {
  double sum = spectrum.noise_amplitude;
  for (int i = 0; i < spectrum.modes_count; ++i) sum += spectrum.modes[static_cast<std::size_t>(i)].amplitude;
  return sum;
}

rt::Duration travel(double path_m) {
  return {static_cast<std::int64_t>(path_m / kSoundSpeedMPerS * static_cast<double>(kNsPerS))};
}

}  // namespace

std::size_t BlockSizes::next(rt::Duration block) noexcept {
  remainder_ += std::clamp(block.ns, std::int64_t{0}, 60 * kNsPerS) * kSampleRateHz;
  const std::int64_t sample_frames = (remainder_ + kNsPerS / 2) / kNsPerS;
  remainder_ -= sample_frames * kNsPerS;
  return static_cast<std::size_t>(sample_frames);
}

std::size_t SoundStage::bytes_needed(const SoundConfig& config) {
  const auto impacts_max = static_cast<std::size_t>(config.impacts_max);
  return rt::bytes_of<Impact>(impacts_max) + rt::bytes_of<Scored>(impacts_max) +
         rt::bytes_of<float>(kClipSamplesMax) + rt::bytes_of<float>(kReflectedSamplesMax);
}

void SoundStage::bind(rt::Slice memory, const SoundConfig& config, const contact::MaterialTable& table,
                      const contact::DistanceField& room) {
  TACTUS_ASSERT(config.impacts_max > 0 && config.sounds_max_per_block > 0);
  TACTUS_ASSERT(config.reflections_max >= 0 && config.reflections_max <= static_cast<int>(kReflectionsMax));
  config_ = config;
  table_ = table;
  room_ = room;
  impacts_ = memory.take<Impact>(static_cast<std::size_t>(config.impacts_max));
  scored_ = memory.take<Scored>(static_cast<std::size_t>(config.impacts_max));
  clip_ = memory.take<float>(kClipSamplesMax);
  reflected_ = memory.take<float>(kReflectedSamplesMax);
}

rt::Status SoundStage::add(const Impact& impact) noexcept {
  ++counts_.impacts;
  const double sum = impact.position_world_m.x + impact.position_world_m.y + impact.position_world_m.z +
                     impact.normal_world.x + impact.normal_world.y + impact.normal_world.z;
  const double energy_j = energy_of(impact);
  if (!std::isfinite(sum + energy_j + impact.body_size_m + impact.surface_size_m) || !(energy_j > 0)) {
    ++counts_.inaudible;
    return rt::Status::skipped;
  }
  Impact held = impact;
  held.delay.ns = std::clamp(impact.delay.ns, std::int64_t{0}, kNsPerS);
  if (impacts_count_ < impacts_.size()) {
    impacts_[impacts_count_++] = held;
    return rt::Status::ok;
  }
  ++counts_.left_out;
  const auto quietest =
      std::min_element(impacts_.begin(), impacts_.end(),
                       [](const Impact& a, const Impact& b) { return energy_of(a) < energy_of(b); });
  if (energy_of(*quietest) < energy_j) *quietest = held;
  return rt::Status::full;
}

rt::Status SoundStage::step(const T_WorldDepth& T_world_listener, hal::SpatialMixer& mixer,
                            std::span<float> stereo) noexcept {
  TACTUS_ASSERT(mixer.format().sample_rate_hz == kSampleRateHz);
  mixer.set_listener(T_world_listener);
  if (T_world_listener.is_finite()) listener_world_m_ = T_world_listener.translation;
  std::size_t audible = 0;
  for (std::size_t i = 0; i < impacts_count_; ++i) {
    const std::uint32_t seed = ++seed_;
    const double distance_m = std::max(kNearestM, (impacts_[i].position_world_m - listener_world_m_).norm());
    const double loudness =
        config_.gain * amplitude_of(spectrum_of(strike_of(impacts_[i], seed), table_)) / distance_m;
    if (loudness < config_.audible_least)
      ++counts_.inaudible;
    else
      scored_[audible++] = {loudness, static_cast<std::uint32_t>(i), seed};
  }
  const auto scored = scored_.first(audible);
  std::sort(scored.begin(), scored.end(), [](const Scored& a, const Scored& b) {
    return a.loudness != b.loudness ? a.loudness > b.loudness : a.impact < b.impact;
  });
  const std::size_t heard = std::min(audible, static_cast<std::size_t>(config_.sounds_max_per_block));
  counts_.left_out += audible - heard;
  for (std::size_t i = 0; i < heard; ++i) begin_sound(scored[i], static_cast<int>(heard - i - 1), mixer);
  impacts_count_ = 0;
  counts_.sample_frames += stereo.size() / 2;
  return mixer.mix(stereo);
}

void SoundStage::begin_sound(const Scored& scored, int sounds_to_come, hal::SpatialMixer& mixer) noexcept {
  const Impact& impact = impacts_[scored.impact];
  const std::size_t samples_count =
      synthesize(spectrum_of(strike_of(impact, scored.seed), table_), scored.seed, clip_);
  const std::span<const float> clip = clip_.first(samples_count);
  hal::SpatialClip sound;
  sound.samples = clip;
  sound.position_world_m = impact.position_world_m;
  sound.gain = static_cast<float>(config_.gain);
  sound.delay = impact.delay + travel((impact.position_world_m - listener_world_m_).norm());
  if (mixer.play(sound) != rt::Status::ok) {
    ++counts_.left_out;
    return;
  }
  ++counts_.sounds;

  std::array<Reflection, kReflectionsMax> reflections;
  const int count = find_reflections(
      room_, table_, {impact.position_world_m, impact.normal_world, listener_world_m_}, config_.room_range_m,
      std::span(reflections).first(static_cast<std::size_t>(config_.reflections_max)));
  const std::span<float> answer = reflected_.first(std::min(samples_count, kReflectedSamplesMax));
  for (int i = 0; i < count; ++i) {
    if (mixer.voices_free() <= sounds_to_come) {
      counts_.reflections_left_out += static_cast<std::uint64_t>(count - i);
      return;
    }
    const Reflection& reflection = reflections[static_cast<std::size_t>(i)];
    apply_bands(reflection.gain, clip.first(answer.size()), answer);
    const std::size_t fade = std::min(kReflectedFadeSamples, answer.size());
    for (std::size_t k = 0; k < fade; ++k)
      answer[answer.size() - 1 - k] *= static_cast<float>(k) / static_cast<float>(fade);
    sound.samples = answer;
    sound.position_world_m = reflection.image_world_m;
    sound.delay = impact.delay + travel(reflection.path_m);
    if (mixer.play(sound) == rt::Status::ok)
      ++counts_.reflections;
    else
      ++counts_.reflections_left_out;
  }
}

}  // namespace tactus::sound
