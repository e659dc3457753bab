#include "hal/wav/wav_writer.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <string_view>
#include <utility>

namespace tactus::hal {
namespace {

static_assert(std::endian::native == std::endian::little, "WAVE is little-endian, and so are our machines");

// One header for both kinds: "fmt " with its extension's length and "fact" are required of float files and
// allowed in the others.
constexpr std::size_t kHeaderBytes = 58;
constexpr std::uint64_t kDataBytesMax = 0xFFFFFFFFU - kHeaderBytes;
constexpr std::uint16_t kPcm = 1, kIeeeFloat = 3;

std::uint16_t sample_bytes(WavSample sample) { return sample == WavSample::int16 ? 2 : 4; }

std::int16_t to_int16(float sample) {
  if (std::isnan(sample)) return 0;
  return static_cast<std::int16_t>(std::lrint(std::clamp(sample * 32768.0F, -32768.0F, 32767.0F)));
}

class Header {
 public:
  void put_tag(std::string_view tag) {
    std::memcpy(&bytes_[size_], tag.data(), tag.size());
    size_ += tag.size();
  }
  template <typename T>
  void put(T number) {
    std::memcpy(&bytes_[size_], &number, sizeof(number));
    size_ += sizeof(number);
  }
  [[nodiscard]] const std::array<char, kHeaderBytes>& bytes() const {
    TACTUS_ASSERT(size_ == kHeaderBytes);
    return bytes_;
  }

 private:
  std::array<char, kHeaderBytes> bytes_{};
  std::size_t size_ = 0;
};

}  // namespace

rt::Result<WavFile> WavFile::create(const std::filesystem::path& path, SoundFormat format, WavSample sample) {
  if (format.channels_count < 1 || format.channels_count > 8 || format.sample_rate_hz < 1 ||
      format.sample_rate_hz > 384000)
    return rt::Error{rt::ExitCode::bad_usage,
                     path.string() + ": a sound of " + std::to_string(format.channels_count) +
                         " channels at " + std::to_string(format.sample_rate_hz) +
                         " Hz cannot be written; name 1 to 8 channels and 1 to 384000 Hz."};
  const int descriptor = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (descriptor < 0)
    return rt::Error{rt::ExitCode::failed,
                     path.string() + ": the file cannot be created (" + std::strerror(errno) + ")."};
  WavFile file(descriptor, path, format, sample);
  if (!file.write_header()) return file.close().error();
  return file;
}

WavFile::WavFile(WavFile&& other) noexcept
    : file_(std::exchange(other.file_, -1)),
      path_(std::move(other.path_)),
      format_(other.format_),
      sample_(other.sample_),
      error_(other.error_),
      sample_frames_written_(other.sample_frames_written_),
      sample_frames_in_header_(other.sample_frames_in_header_) {}

WavFile::~WavFile() {
  if (file_ >= 0) finish();
}

std::uint64_t WavFile::bytes_per_frame() const {
  return static_cast<std::uint64_t>(format_.channels_count) * sample_bytes(sample_);
}

bool WavFile::write_bytes(const void* data, std::size_t bytes_count) noexcept {
  const char* bytes = static_cast<const char*>(data);
  while (bytes_count > 0) {
    const ssize_t done = ::write(file_, bytes, bytes_count);
    if (done < 0 && errno == EINTR) continue;
    if (done <= 0) {
      if (error_ == 0) error_ = done < 0 ? errno : ENOSPC;
      return false;
    }
    bytes += done;
    bytes_count -= static_cast<std::size_t>(done);
  }
  return true;
}

bool WavFile::write_header() noexcept {
  const auto data_bytes = static_cast<std::uint32_t>(sample_frames_written_ * bytes_per_frame());
  const auto rate_hz = static_cast<std::uint32_t>(format_.sample_rate_hz);
  Header header;
  header.put_tag("RIFF");
  header.put(static_cast<std::uint32_t>(kHeaderBytes - 8 + data_bytes));
  header.put_tag("WAVEfmt ");
  header.put(std::uint32_t{18});
  header.put(sample_ == WavSample::int16 ? kPcm : kIeeeFloat);
  header.put(static_cast<std::uint16_t>(format_.channels_count));
  header.put(rate_hz);
  header.put(static_cast<std::uint32_t>(rate_hz * bytes_per_frame()));
  header.put(static_cast<std::uint16_t>(bytes_per_frame()));
  header.put(static_cast<std::uint16_t>(8 * sample_bytes(sample_)));
  header.put(std::uint16_t{0});
  header.put_tag("fact");
  header.put(std::uint32_t{4});
  header.put(static_cast<std::uint32_t>(sample_frames_written_));
  header.put_tag("data");
  header.put(data_bytes);
  const bool is_there = ::lseek(file_, 0, SEEK_SET) == 0 &&
                        write_bytes(header.bytes().data(), kHeaderBytes) &&
                        ::lseek(file_, static_cast<off_t>(data_bytes), SEEK_CUR) >= 0;
  if (!is_there && error_ == 0) error_ = errno;
  sample_frames_in_header_ = sample_frames_written_;
  return is_there;
}

rt::Status WavFile::write(std::span<const float> samples) noexcept {
  const auto channels_count = static_cast<std::size_t>(format_.channels_count);
  TACTUS_ASSERT(file_ >= 0);
  TACTUS_ASSERT(samples.size() % channels_count == 0);
  if (error_ != 0) return rt::Status::device_lost;
  const std::uint64_t frames_count = samples.size() / channels_count;
  if ((sample_frames_written_ + frames_count) * bytes_per_frame() > kDataBytesMax) {
    error_ = EFBIG;
    return rt::Status::device_lost;
  }
  if (sample_ == WavSample::float32) {
    if (!write_bytes(samples.data(), samples.size_bytes())) return rt::Status::device_lost;
  } else {
    std::array<std::int16_t, 2048> piece;
    for (std::size_t at = 0; at < samples.size(); at += piece.size()) {
      const auto part = samples.subspan(at, std::min(piece.size(), samples.size() - at));
      std::transform(part.begin(), part.end(), piece.begin(), to_int16);
      if (!write_bytes(piece.data(), part.size() * sizeof(std::int16_t))) return rt::Status::device_lost;
    }
  }
  sample_frames_written_ += frames_count;
  const std::uint64_t since_header = sample_frames_written_ - sample_frames_in_header_;
  if (since_header >= static_cast<std::uint64_t>(format_.sample_rate_hz) && !write_header())
    return rt::Status::device_lost;
  return rt::Status::ok;
}

// What a write that failed has left behind the last whole one is cut off.
void WavFile::finish() noexcept {
  write_header();
  const auto length = static_cast<off_t>(kHeaderBytes + sample_frames_written_ * bytes_per_frame());
  if (error_ != 0 && ::ftruncate(file_, length) != 0) error_ = errno;
  if (::close(file_) != 0 && error_ == 0) error_ = errno;
  file_ = -1;
}

rt::Result<void> WavFile::close() {
  TACTUS_ASSERT(file_ >= 0);
  finish();
  if (error_ != 0)
    return rt::Error{rt::ExitCode::failed,
                     path_.string() + ": writing failed (" + std::strerror(error_) + "); is the disk full?"};
  return {};
}

}  // namespace tactus::hal
