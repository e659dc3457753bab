#include <gtest/gtest.h>

#include <random>

#include "hal/openni2/oni_index.hpp"
#include "hal/openni2/oni_writer.hpp"
#include "tests/hal/openni2/made_sensor.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tactus::hal::openni2 {
namespace {

const test::TemporaryFolder& folder() {
  static const test::TemporaryFolder made;
  return made;
}

std::string written(unsigned depth_count, unsigned color_count) {
  static int number = 0;
  const std::string name = std::to_string(number++) + ".oni";
  Sensor sensor = made_sensor(depth_count, color_count);
  EXPECT_TRUE(write_oni(folder().path() / name, sensor));
  return folder().read(name);
}

rt::Result<OniIndex> index_of(std::string_view bytes) { return read_oni_index(folder().write("x.oni", bytes)); }

TEST(OniIndex, WrittenFile_HasEveryFrameWithItsTime) {
  const auto index = index_of(written(5, 3));
  ASSERT_TRUE(index) << index.error().message;
  ASSERT_TRUE(index->depth && index->color);
  EXPECT_FALSE(index->cut_at);
  ASSERT_EQ(index->depth->frames.size(), 5U);
  ASSERT_EQ(index->color->frames.size(), 3U);
  for (std::uint32_t i = 0; i < 5; ++i) {
    EXPECT_EQ(index->depth->frames[i].number, i + 1);
    EXPECT_EQ(index->depth->frames[i].time_us, i * 33'333'333ULL / 1000);
  }
  EXPECT_EQ(index->color->frames[1].time_us, 36'333U);
  EXPECT_EQ(index->depth->width, kMadeWidth);
  EXPECT_EQ(index->depth->height, kMadeHeight);
  EXPECT_TRUE(index->depth->sees_from_color);
  EXPECT_EQ(index->depth->frame_rate_hz, 30);
}

TEST(OniIndex, RealKinectFile_HasTwelveAndTwelve) {
  const auto file = test::shared_data("oni/kinect_v1_12frames.oni");
  if (!file) GTEST_SKIP() << "the shared recordings are not beside the project";
  const auto index = read_oni_index(*file);
  ASSERT_TRUE(index) << index.error().message;
  EXPECT_EQ(index->depth->frames.size(), 12U);
  EXPECT_EQ(index->color->frames.size(), 12U);
  EXPECT_EQ(index->depth->codec, kCodec16zTables);
  EXPECT_EQ(index->color->codec, kCodecJpeg);
  EXPECT_TRUE(index->depth->sees_from_color);
  EXPECT_NEAR(index->depth->fov_x_rad, 1.0144, 1e-3);
}

TEST(OniIndex, EmptyRecording_IsRefusedInOneSentence) {
  const auto file = test::shared_data("oni/empty_recording.oni");
  if (!file) GTEST_SKIP() << "the shared recordings are not beside the project";
  const auto refused = read_oni_index(*file);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, rt::ExitCode::bad_input);
  EXPECT_NE(refused.error().message.find("no frames"), std::string::npos) << refused.error().message;
}

TEST(OniIndex, NoFileOrNoRecording_IsRefused) {
  EXPECT_FALSE(read_oni_index(folder().path() / "absent.oni"));
  EXPECT_FALSE(read_oni_index(folder().path()));
  for (const char* bytes : {"", "NI10", "GARBAGE GARBAGE GARBAGE GARBAGE"}) {
    const auto refused = index_of(bytes);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, rt::ExitCode::bad_input);
    EXPECT_NE(refused.error().message.find("not an .oni"), std::string::npos) << refused.error().message;
  }
}

/// Wherever it is cut: refused with the byte, or played up to there, and never more frames than are whole.
TEST(OniIndex, CutAnywhere_IsSaidOrPlayedToThere) {
  const std::string whole = written(2, 2);
  std::size_t played_count = 0;
  for (std::size_t bytes = kFileHeaderBytes; bytes < whole.size(); bytes += bytes % 97 == 0 ? 61U : 13U) {
    const auto index = index_of(std::string_view(whole).substr(0, bytes));
    if (!index) {
      EXPECT_EQ(index.error().code, rt::ExitCode::bad_input);
      continue;
    }
    ++played_count;
    ASSERT_TRUE(index->cut_at);
    EXPECT_LE(*index->cut_at, bytes);
  }
  EXPECT_GT(played_count, 0U) << "without its end record a file is still whole";
}

/// The walk itself must stand any bytes; what it lets through has streams that can be played.
TEST(OniIndex, FlippedBits_NeverCrashTheWalk) {
  const std::string whole = written(3, 3);
  constexpr unsigned kSeed = 20261130;
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  std::mt19937 random(kSeed);
  for (int round = 0; round < 600; ++round) {
    std::string bytes = whole;
    for (unsigned i = 0; i <= random() % 4; ++i)
      bytes[random() % (round % 2 == 0 ? 3000 : bytes.size())] ^= static_cast<char>(1U << random() % 8);
    const auto index = index_of(bytes);
    if (!index) {
      ASSERT_FALSE(index.error().message.empty());
      continue;
    }
    ASSERT_TRUE(index->depth);
    ASSERT_GT(index->depth->width * index->depth->height, 0);
    ASSERT_LE(index->depth->frames.size(), 3U);
  }
}

TEST(OniWriter, ExistingFile_IsNotTouched) {
  folder().write("mine.oni", "mine");
  Sensor sensor = made_sensor(1, 0);
  const auto refused = write_oni(folder().path() / "mine.oni", sensor);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, rt::ExitCode::bad_usage);
  EXPECT_EQ(folder().read("mine.oni"), "mine");
  EXPECT_FALSE(write_oni(folder().path() / "no" / "such" / "x.oni", sensor));
}

TEST(OniWriter, CountsWhatItWrote) {
  Sensor sensor = made_sensor(4, 6);
  const auto counts = write_oni(folder().path() / "counted.oni", sensor);
  ASSERT_TRUE(counts);
  EXPECT_EQ(counts->depth_frames_count, 4U);
  EXPECT_EQ(counts->color_frames_count, 6U);
}

}  // namespace
}  // namespace tactus::hal::openni2
