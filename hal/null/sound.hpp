// A sound sink that swallows and counts.
#pragma once

#include "hal/sound.hpp"

namespace tactus::hal::null {

class SoundSink final : public hal::SoundSink {
 public:
  explicit SoundSink(SoundFormat format) : format_(format) {}
  [[nodiscard]] SoundFormat format() const override { return format_; }
  rt::Status write(std::span<const float> samples) noexcept override {
    const auto channels_count = static_cast<std::size_t>(format_.channels_count);
    TACTUS_ASSERT(samples.size() % channels_count == 0);
    sample_frames_written_ += samples.size() / channels_count;
    return rt::Status::ok;
  }
  [[nodiscard]] std::uint64_t sample_frames_written() const override { return sample_frames_written_; }

 private:
  SoundFormat format_;
  std::uint64_t sample_frames_written_ = 0;
};

}  // namespace tactus::hal::null
