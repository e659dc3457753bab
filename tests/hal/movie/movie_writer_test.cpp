// Films are read back with libav and held against what was written.
#include "hal/movie/movie_writer.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cmath>
#include <csignal>
#include <numbers>

#include "tests/hal/movie/film_reader.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tactus::hal {
namespace {

constexpr int kWidth = 160, kHeight = 120;
constexpr double kToneHz = 440;

// A soft slope of colours with a square of 24 pixels that moves by 2 pixels a picture, on the chroma's grid.
std::vector<std::uint8_t> picture(int index) {
  std::vector<std::uint8_t> rgb;
  const int left = 2 * index % (kWidth - 24), top = 40;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const bool inside = x >= left && x < left + 24 && y >= top && y < top + 24;
      const std::array<int, 3> color = inside ? std::array{220, 60, 40} : std::array{x, 100, 255 - 2 * y};
      for (const int channel : color) rgb.push_back(static_cast<std::uint8_t>(channel));
    }
  return rgb;
}

std::vector<float> tone(int from_sample, int count) {
  std::vector<float> samples;
  for (int i = from_sample; i < from_sample + count; ++i) {
    const auto value = static_cast<float>(0.5 * std::sin(2 * std::numbers::pi * kToneHz * i / 48000));
    samples.push_back(value);
    samples.push_back(-value);
  }
  return samples;
}

double psnr_db(const std::vector<std::uint8_t>& a, const std::vector<std::uint8_t>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
  return 10 * std::log10(255.0 * 255.0 * static_cast<double>(a.size()) / sum);
}

// The amplitude of one frequency, by projecting on sine and cosine.
double amplitude(const std::vector<float>& samples, double frequency_hz) {
  double sine = 0, cosine = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double phase = 2 * std::numbers::pi * frequency_hz * static_cast<double>(i) / 48000;
    sine += static_cast<double>(samples[i]) * std::sin(phase);
    cosine += static_cast<double>(samples[i]) * std::cos(phase);
  }
  return 2 * std::hypot(sine, cosine) / static_cast<double>(samples.size());
}

class MovieWriterTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    const test::TemporaryFolder folder;
    const auto created = MovieWriter::create(folder.path() / "x.mp4", {.width_px = 64, .height_px = 48});
    has_encoder_ = created || created.error().code != rt::ExitCode::device_unavailable;
  }
  void SetUp() override {
    if (!has_encoder_) GTEST_SKIP() << "libavcodec has neither libx264 nor mpeg4 here";
  }

  [[nodiscard]] std::filesystem::path path(const char* name) const { return folder_.path() / name; }

  static MovieFormat format() { return {kWidth, kHeight, 30, {48000, 2}, kPictureEncoders}; }

  static rt::Result<void> write(const std::filesystem::path& file, int pictures_count, int sound_per_picture,
                                const MovieFormat& format) {
    auto film = MovieWriter::create(file, format);
    if (!film) return film.error();
    for (int i = 0; i < pictures_count; ++i) {
      film->write_picture(static_cast<std::uint64_t>(i), picture(i));
      if (format.sound.channels_count != 0) film->write_sound(tone(i * sound_per_picture, sound_per_picture));
    }
    return film->close();
  }

  static inline bool has_encoder_ = false;
  test::TemporaryFolder folder_;
};

TEST_F(MovieWriterTest, PicturesAndSoundComeBackInTime) {
  ASSERT_TRUE(write(path("a.mp4"), 60, 1600, format()));
  const auto film = testing::read_film(path("a.mp4"));
  EXPECT_EQ(film.width_px, kWidth);
  EXPECT_EQ(film.height_px, kHeight);
  ASSERT_EQ(film.pictures.size(), 60U);
  for (int i = 0; i < 60; ++i) {
    const auto& [time_s, rgb] = film.pictures[static_cast<std::size_t>(i)];
    EXPECT_NEAR(time_s, i / 30.0, 1e-3);
    EXPECT_GT(psnr_db(rgb, picture(i)), 30) << "picture " << i;
  }
  EXPECT_NEAR(film.picture_duration_s, 2.0, 1e-3);
  EXPECT_NEAR(film.sound_duration_s, 2.0, 1e-3);
  EXPECT_EQ(film.sound_codec, "aac");
  EXPECT_EQ(film.sample_rate_hz, 48000);
  EXPECT_LT(std::abs(film.sound_start_s - film.pictures[0].time_s), 1e-3);
  for (const auto& channel : film.sound) {
    EXPECT_NEAR(amplitude(channel, kToneHz), 0.5, 0.02);
    EXPECT_LT(amplitude(channel, 0.75 * kToneHz), 0.01);
    EXPECT_LT(amplitude(channel, 1.5 * kToneHz), 0.01);
  }
  // The channels are of opposite sign and start at the first sample: nothing is shifted.
  EXPECT_NEAR(film.sound[0][4827], 0.5 * std::sin(2 * std::numbers::pi * kToneHz * 4827 / 48000), 0.05);
  EXPECT_NEAR(film.sound[0][4827], -film.sound[1][4827], 0.02);
}

TEST_F(MovieWriterTest, IndexStandsAtTheFront) {
  ASSERT_TRUE(write(path("a.mp4"), 5, 1600, format()));
  const std::string film = folder_.read("a.mp4");
  ASSERT_NE(film.find("moov"), std::string::npos);
  EXPECT_LT(film.find("moov"), film.find("mdat"));
}

TEST_F(MovieWriterTest, SameInputGivesTheSameBytes) {
  ASSERT_TRUE(write(path("a.mp4"), 60, 1600, format()));
  ASSERT_TRUE(write(path("b.mp4"), 60, 1600, format()));
  EXPECT_FALSE(folder_.read("a.mp4").empty());
  EXPECT_TRUE(folder_.read("a.mp4") == folder_.read("b.mp4"));
}

TEST_F(MovieWriterTest, PictureLeftOutLeavesItsPredecessorStanding) {
  auto film = MovieWriter::create(path("a.mp4"), {kWidth, kHeight, 29.97, {48000, 0}, kPictureEncoders});
  ASSERT_TRUE(film) << film.error().message;
  for (const int index : {0, 1, 5, 6, 20})
    film->write_picture(static_cast<std::uint64_t>(index), picture(index));
  ASSERT_TRUE(film->close());
  const auto back = testing::read_film(path("a.mp4"));
  EXPECT_EQ(back.sound_codec, "");
  ASSERT_EQ(back.pictures.size(), 5U);
  EXPECT_NEAR(back.pictures[2].time_s, 5 / 29.97, 1e-3);
  EXPECT_NEAR(back.pictures[4].time_s, 20 / 29.97, 1e-3);
  EXPECT_NEAR(back.picture_duration_s, 21 / 29.97, 1e-3);
  EXPECT_GT(psnr_db(back.pictures[4].rgb, picture(20)), 30);
}

TEST_F(MovieWriterTest, ShortSoundIsFilledUpWithSilence) {
  ASSERT_TRUE(write(path("a.mp4"), 30, 1000, format()));
  const auto film = testing::read_film(path("a.mp4"));
  EXPECT_NEAR(film.picture_duration_s, 1.0, 1e-3);
  EXPECT_NEAR(film.sound_duration_s, 1.0, 1e-3);
  ASSERT_GT(film.sound[0].size(), 40000U);
  EXPECT_LT(std::abs(film.sound[0][40000]), 1e-3F);
}

TEST_F(MovieWriterTest, LastPictureStandsWhileThereIsSound) {
  ASSERT_TRUE(write(path("a.mp4"), 30, 2410, format()));
  const auto film = testing::read_film(path("a.mp4"));
  EXPECT_NEAR(film.sound_duration_s, 46 / 30.0, 1e-3);  // 1.506 s of sound, rounded up to whole pictures
  EXPECT_NEAR(film.picture_duration_s, film.sound_duration_s, 1e-3);
  EXPECT_GT(psnr_db(film.pictures.back().rgb, picture(29)), 30);
}

TEST_F(MovieWriterTest, WithoutX264Mpeg4Takes) {
  constexpr std::array<const char*, 2> kNames{"no_such_encoder", "mpeg4"};
  MovieFormat other = format();
  other.picture_encoders = kNames;
  ASSERT_TRUE(write(path("a.mp4"), 20, 1600, other));
  const auto film = testing::read_film(path("a.mp4"));
  EXPECT_EQ(film.picture_codec, "mpeg4");
  ASSERT_EQ(film.pictures.size(), 20U);
  EXPECT_NEAR(film.picture_duration_s, 20 / 30.0, 1e-3);
  EXPECT_GT(psnr_db(film.pictures[19].rgb, picture(19)), 30);
}

TEST_F(MovieWriterTest, WithoutAnyEncoderCreateNamesThoseItLookedFor) {
  constexpr std::array<const char*, 1> kNames{"no_such_encoder"};
  MovieFormat other = format();
  other.picture_encoders = kNames;
  const auto refused = MovieWriter::create(path("a.mp4"), other);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, rt::ExitCode::device_unavailable);
  EXPECT_NE(refused.error().message.find("no_such_encoder"), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(path("a.mp4")));
}

TEST_F(MovieWriterTest, WhatCannotBeWrittenIsBadUsage) {
  for (const MovieFormat& wrong : {MovieFormat{161, 120, 30, {48000, 2}, kPictureEncoders},
                                   MovieFormat{160, 121, 30, {48000, 2}, kPictureEncoders},
                                   MovieFormat{0, 0, 30, {48000, 2}, kPictureEncoders},
                                   MovieFormat{160, 120, 0, {48000, 2}, kPictureEncoders},
                                   MovieFormat{160, 120, 30, {48000, 3}, kPictureEncoders},
                                   MovieFormat{160, 120, 30, {12345, 2}, kPictureEncoders}}) {
    const auto refused = MovieWriter::create(path("a.mp4"), wrong);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, rt::ExitCode::bad_usage) << refused.error().message;
    EXPECT_FALSE(std::filesystem::exists(path("a.mp4")));
  }
}

TEST_F(MovieWriterTest, FileThatCannotBeMadeFailsWithItsPath) {
  const auto refused = MovieWriter::create(path("no_such_folder/a.mp4"), format());
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, rt::ExitCode::failed);
  EXPECT_NE(refused.error().message.find("no_such_folder"), std::string::npos);
}

TEST_F(MovieWriterTest, FullDiskFailsWithItsPath) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
  const auto failed = write("/dev/full", 60, 1600, format());
  ASSERT_FALSE(failed);
  EXPECT_EQ(failed.error().code, rt::ExitCode::failed);
  EXPECT_NE(failed.error().message.find("/dev/full"), std::string::npos);
  EXPECT_NE(failed.error().message.find("No space left"), std::string::npos) << failed.error().message;
}

TEST_F(MovieWriterTest, DiskThatFillsWithTheLastByteIsSaidAtClose) {
  ASSERT_TRUE(write(path("a.mp4"), 60, 1600, format()));
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  rlimit limit = before;
  limit.rlim_cur = std::filesystem::file_size(path("a.mp4")) - 1;
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &limit), 0);
  const auto failed = write(path("b.mp4"), 60, 1600, format());
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  ASSERT_FALSE(failed);
  EXPECT_EQ(failed.error().code, rt::ExitCode::failed);
  EXPECT_NE(failed.error().message.find("disk full?"), std::string::npos) << failed.error().message;
}

TEST_F(MovieWriterTest, FilmWithoutAPictureFailsAtClose) {
  EXPECT_FALSE(write(path("a.mp4"), 0, 0, format()));
}

TEST_F(MovieWriterTest, FilmThatWasNotClosedIsStillPlayable) {
  {
    auto film = MovieWriter::create(path("a.mp4"), format());
    ASSERT_TRUE(film);
    film->write_picture(0, picture(0));
  }
  EXPECT_EQ(testing::read_film(path("a.mp4")).pictures.size(), 1U);
}

}  // namespace
}  // namespace tactus::hal
