#include "firmware_host/recorder.hpp"

#include <algorithm>

namespace tactus::firmware {
namespace {

constexpr int kSampleRateHz = 48000;
constexpr std::size_t kBlockSampleFrames = 1600;  // a thirtieth of a second

}  // namespace

rt::Result<std::unique_ptr<Recorder>> Recorder::create(const RecorderConfig& config) {
  std::unique_ptr<Recorder> recorder(new Recorder);
  recorder->config_ = config;
  const auto leave_out = [&](const std::string& what, const rt::Error& why) {
    recorder->notes_.push_back({Note::Kind::warning, what + why.message});
  };
  if (config.has_pictures && !config.movie.empty()) {
    hal::MovieFormat format;
    format.width_px = config.width_px;
    format.height_px = config.height_px;
    format.frame_rate_hz = config.frame_rate_hz;
    format.sound.channels_count = config.has_sound ? 2 : 0;
    auto movie = hal::MovieWriter::create(config.movie, format);
    if (!movie && movie.error().code == rt::ExitCode::failed) return movie.error();
    if (movie)
      recorder->movie_.emplace(std::move(*movie));
    else
      leave_out("No " + config.movie.filename().string() + ": ", movie.error());
  }
  if (config.has_sound && !config.sound.empty()) {
    auto wav = hal::WavFile::create(config.sound, {kSampleRateHz, 2});
    if (!wav) return wav.error();
    recorder->wav_.emplace(std::move(*wav));
  }
  if (config.has_sound && config.plays) {
    auto playback = hal::openal::Playback::create();
    if (playback)
      recorder->playback_.emplace(std::move(*playback));
    else
      leave_out("Nothing is heard: ", playback.error());
  }
  if (recorder->movie_)
    for (auto& picture : recorder->pictures_)
      picture.resize(static_cast<std::size_t>(config.width_px) * static_cast<std::size_t>(config.height_px) * 3);
  recorder->block_.resize(2 * kBlockSampleFrames);
  recorder->offered_in_.emplace(recorder->offered_.producer());
  recorder->offered_out_.emplace(recorder->offered_.consumer());
  recorder->free_in_.emplace(recorder->free_.producer());
  recorder->free_out_.emplace(recorder->free_.consumer());
  for (std::uint32_t slot = 0; slot < kSlots; ++slot) (void)recorder->free_in_->try_push(slot);
  return recorder;
}

bool Recorder::offer(std::uint64_t index, std::span<const std::uint8_t> rgb) noexcept {
  std::uint32_t slot = 0;
  if (!free_out_->try_pop(slot)) {
    ++pictures_left_out_;
    return false;
  }
  if (movie_) std::copy(rgb.begin(), rgb.end(), pictures_[slot].begin());
  return offered_in_->try_push({index, slot});
}

void Recorder::mix_until(std::uint64_t sample_frame, Pipeline& pipeline, rt::Clock clock) {
  while (sample_frames_mixed_ < sample_frame) {
    const auto count = static_cast<std::size_t>(
        std::min<std::uint64_t>(kBlockSampleFrames, sample_frame - sample_frames_mixed_));
    const std::span<float> samples = std::span(block_).first(2 * count);
    if (pipeline.sound_round(clock, samples) != rt::Status::ok) std::fill(samples.begin(), samples.end(), 0.0f);
    sample_frames_mixed_ += count;
    if (wav_) (void)wav_->write(samples);  // a failure is told at close
    if (movie_) movie_->write_sound(samples);
    if (playback_ && playback_->write(samples) == rt::Status::device_lost) {
      notes_.push_back({Note::Kind::warning, "The sound device went away; the run went on without it."});
      playback_.reset();
    }
  }
}

bool Recorder::round(Pipeline& pipeline, rt::Clock clock) {
  Offer offer;
  if (!offered_out_->try_pop(offer)) return false;
  if (config_.has_sound)
    mix_until(static_cast<std::uint64_t>(static_cast<double>(offer.index + 1) * kSampleRateHz / config_.frame_rate_hz),
              pipeline, clock);
  if (movie_) {
    movie_->write_picture(offer.index, pictures_[offer.slot]);
    ++pictures_written_;
  }
  (void)free_in_->try_push(offer.slot);
  return true;
}

rt::Result<void> Recorder::close(Pipeline& pipeline, rt::Clock clock) {
  while (round(pipeline, clock)) {
  }
  rt::Result<void> closed;
  if (wav_) closed = wav_->close();
  if (movie_) {
    auto film = movie_->close();
    if (closed) closed = std::move(film);
  }
  if (pictures_left_out_ > 0 && movie_)
    notes_.push_back({Note::Kind::warning, std::to_string(pictures_left_out_) + " pictures were left out of " +
                                               config_.movie.filename().string() + ": the "
                                               "encoder was not done with those before. Their predecessors stand longer."});
  return closed;
}

}  // namespace tactus::firmware
