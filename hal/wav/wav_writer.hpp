// A sound sink that is a .wav file, playable at any time while it is written.
#pragma once

#include <filesystem>

#include "hal/sound.hpp"

namespace tactus::hal {

enum class WavSample : std::uint8_t {
  int16,   // rounded to nearest; beyond [-1, 1] clipped
  float32  // as it comes
};

/// RIFF WAVE with a header that is mended after every second of sound, so that a program that is killed
/// leaves a file that plays. write() takes no memory, but it is a system call to the disk: never on a
/// real-time thread.
class WavFile final : public SoundSink {
 public:
  /// Makes or empties the file. Boot. Errors: failed (it cannot be made), bad_usage (not 1 to 8 channels, not
  /// 1 to 384000 Hz).
  static rt::Result<WavFile> create(const std::filesystem::path& path, SoundFormat format,
                                    WavSample sample = WavSample::int16);

  WavFile(WavFile&& other) noexcept;
  WavFile& operator=(WavFile&&) = delete;
  ~WavFile() override;  // a file that was not closed is closed silently

  [[nodiscard]] SoundFormat format() const override { return format_; }
  /// device_lost once anything could not be written (disk full, 4 GiB reached, which is where WAVE ends);
  /// close() says what. The file then ends with the last write that was taken.
  rt::Status write(std::span<const float> samples) noexcept override;
  [[nodiscard]] std::uint64_t sample_frames_written() const override { return sample_frames_written_; }

  /// Mends the header for the last time; `failed` when anything went wrong since create. Once.
  rt::Result<void> close();

 private:
  WavFile(int file, std::filesystem::path path, SoundFormat format, WavSample sample)
      : file_(file), path_(std::move(path)), format_(format), sample_(sample) {}
  [[nodiscard]] std::uint64_t bytes_per_frame() const;
  bool write_bytes(const void* data, std::size_t bytes_count) noexcept;
  bool write_header() noexcept;
  void finish() noexcept;

  int file_;  // descriptor; -1: closed or moved from
  std::filesystem::path path_;
  SoundFormat format_;
  WavSample sample_;
  int error_ = 0;  // the first one; errno's
  std::uint64_t sample_frames_written_ = 0;
  std::uint64_t sample_frames_in_header_ = 0;
};

}  // namespace tactus::hal
