// Files are read back byte by byte, as the WAVE format names them.
#include "hal/wav/wav_writer.hpp"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <vector>

#include "tests/support/temporary_folder.hpp"

namespace tactus::hal {
namespace {

struct Wav {
  int format = 0, channels_count = 0, sample_rate_hz = 0, bytes_per_second = 0, bytes_per_frame = 0,
      bits_per_sample = 0;
  std::string data;
};

template <typename T>
T number(const std::string& bytes, std::size_t at) {
  T value{};
  std::memcpy(&value, bytes.data() + at, sizeof(value));
  return value;
}

// Walks the chunks, as a player does; nothing where a length leads astray.
std::optional<Wav> parse(const std::string& bytes) {
  if (bytes.size() < 12 || bytes.substr(0, 4) != "RIFF" || bytes.substr(8, 4) != "WAVE") return std::nullopt;
  if (number<std::uint32_t>(bytes, 4) + 8 > bytes.size()) return std::nullopt;
  Wav wav;
  for (std::size_t at = 12; at + 8 <= bytes.size();) {
    const std::string tag = bytes.substr(at, 4);
    const std::size_t length = number<std::uint32_t>(bytes, at + 4);
    at += 8;
    if (at + length > bytes.size()) return std::nullopt;
    if (tag == "fmt ") {
      wav.format = number<std::uint16_t>(bytes, at);
      wav.channels_count = number<std::uint16_t>(bytes, at + 2);
      wav.sample_rate_hz = number<std::int32_t>(bytes, at + 4);
      wav.bytes_per_second = number<std::int32_t>(bytes, at + 8);
      wav.bytes_per_frame = number<std::uint16_t>(bytes, at + 12);
      wav.bits_per_sample = number<std::uint16_t>(bytes, at + 14);
    }
    if (tag == "data") {
      wav.data = bytes.substr(at, length);
      return wav;
    }
    at += length;
  }
  return std::nullopt;
}

std::vector<float> ramp(std::size_t samples_count) {
  std::vector<float> samples(samples_count);
  for (std::size_t i = 0; i < samples_count; ++i) samples[i] = static_cast<float>(i % 2000) / 1000.0F - 1.0F;
  return samples;
}

class WavFileTest : public testing::Test {
 protected:
  [[nodiscard]] std::filesystem::path path() const { return folder_.path() / "a.wav"; }
  [[nodiscard]] std::optional<Wav> read() const { return parse(folder_.read("a.wav")); }
  test::TemporaryFolder folder_;
};

TEST_F(WavFileTest, SixteenBitsComeBackRoundedAndClipped) {
  auto sut = WavFile::create(path(), {48000, 2});
  ASSERT_TRUE(sut) << sut.error().message;
  const std::vector<float> samples{
      0.0F, 0.5F, -1.0F, 1.0F, 2.0F, -3.0F, std::numeric_limits<float>::quiet_NaN(), 1.4F / 32768};
  EXPECT_EQ(sut->write(samples), rt::Status::ok);
  EXPECT_EQ(sut->sample_frames_written(), 4U);
  ASSERT_TRUE(sut->close());
  const auto wav = read();
  ASSERT_TRUE(wav);
  EXPECT_EQ(wav->format, 1);
  EXPECT_EQ(wav->channels_count, 2);
  EXPECT_EQ(wav->sample_rate_hz, 48000);
  EXPECT_EQ(wav->bytes_per_second, 192000);
  EXPECT_EQ(wav->bytes_per_frame, 4);
  EXPECT_EQ(wav->bits_per_sample, 16);
  ASSERT_EQ(wav->data.size(), 16U);
  const std::vector<std::int16_t> wanted{0, 16384, -32768, 32767, 32767, -32768, 0, 1};
  for (std::size_t i = 0; i < wanted.size(); ++i)
    EXPECT_EQ(number<std::int16_t>(wav->data, 2 * i), wanted[i]);
}

TEST_F(WavFileTest, LongWritesComeBackWholeAndInOrder) {
  auto sut = WavFile::create(path(), {8000, 2});
  ASSERT_TRUE(sut);
  const auto samples = ramp(50000);
  std::size_t at = 0;
  for (const std::size_t count : {2U, 5000U, 4998U, 40000U}) {
    EXPECT_EQ(sut->write(std::span(samples).subspan(at, count)), rt::Status::ok);
    at += count;
  }
  ASSERT_TRUE(sut->close());
  const auto wav = read();
  ASSERT_TRUE(wav);
  ASSERT_EQ(wav->data.size(), 2 * samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i)
    ASSERT_NEAR(number<std::int16_t>(wav->data, 2 * i) / 32768.0F, samples[i], 0.51F / 32768) << i;
}

TEST_F(WavFileTest, FloatsComeBackBitForBit) {
  auto sut = WavFile::create(path(), {44100, 2}, WavSample::float32);
  ASSERT_TRUE(sut);
  const auto samples = ramp(4410);
  EXPECT_EQ(sut->write(samples), rt::Status::ok);
  ASSERT_TRUE(sut->close());
  const auto wav = read();
  ASSERT_TRUE(wav);
  EXPECT_EQ(wav->format, 3);
  EXPECT_EQ(wav->bits_per_sample, 32);
  EXPECT_EQ(wav->sample_rate_hz, 44100);
  ASSERT_EQ(wav->data.size(), 4 * samples.size());
  EXPECT_EQ(std::memcmp(wav->data.data(), samples.data(), wav->data.size()), 0);
}

TEST_F(WavFileTest, KilledProgramLeavesAllButItsLastSecond) {
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    auto sut = WavFile::create(path(), {8000, 2});
    const auto tenth = ramp(1600);
    for (int i = 0; sut && i < 25; ++i) (void)sut->write(tenth);
    raise(SIGKILL);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFSIGNALED(status));
  const auto wav = read();
  ASSERT_TRUE(wav);
  EXPECT_EQ(wav->data.size(), 2U * 8000 * 4);
}

TEST_F(WavFileTest, FileIsPlayableBeforeTheFirstWrite) {
  const auto sut = WavFile::create(path(), {48000, 2});
  ASSERT_TRUE(sut);
  const auto wav = read();
  ASSERT_TRUE(wav);
  EXPECT_TRUE(wav->data.empty());
}

TEST_F(WavFileTest, FullDiskIsDeviceLostThenSaidAtCloseAndWhatFitsPlays) {
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = signal(SIGXFSZ, SIG_IGN);
  rlimit limit = before;
  limit.rlim_cur = 50000;
  auto sut = WavFile::create(path(), {48000, 2});
  ASSERT_TRUE(sut);
  const auto tenth = ramp(9600);
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &limit), 0);
  const rt::Status first = sut->write(tenth), second = sut->write(tenth), third = sut->write(tenth),
                   fourth = sut->write(tenth);
  const auto failed = sut->close();
  setrlimit(RLIMIT_FSIZE, &before);
  signal(SIGXFSZ, handler);
  EXPECT_EQ(first, rt::Status::ok);
  EXPECT_EQ(second, rt::Status::ok);
  EXPECT_EQ(third, rt::Status::device_lost);
  EXPECT_EQ(fourth, rt::Status::device_lost);
  EXPECT_EQ(sut->sample_frames_written(), 9600U);
  ASSERT_FALSE(failed);
  EXPECT_EQ(failed.error().code, rt::ExitCode::failed);
  EXPECT_NE(failed.error().message.find("a.wav"), std::string::npos);
  const auto wav = read();
  ASSERT_TRUE(wav);
  EXPECT_EQ(wav->data.size(), 9600U * 4);
}

TEST_F(WavFileTest, WhatCannotBeWrittenIsRefusedWithOneSentence) {
  const auto nowhere = WavFile::create(folder_.path() / "no_such_folder" / "a.wav", {48000, 2});
  ASSERT_FALSE(nowhere);
  EXPECT_EQ(nowhere.error().code, rt::ExitCode::failed);
  EXPECT_NE(nowhere.error().message.find("no_such_folder"), std::string::npos);
  for (const SoundFormat format : {SoundFormat{48000, 0}, SoundFormat{48000, 9}, SoundFormat{0, 2}}) {
    const auto refused = WavFile::create(path(), format);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, rt::ExitCode::bad_usage);
  }
}

TEST_F(WavFileTest, DiskFullAtOnceIsSaidByCreate) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
  const auto refused = WavFile::create("/dev/full", {48000, 2});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, rt::ExitCode::failed);
}

}  // namespace
}  // namespace tactus::hal
