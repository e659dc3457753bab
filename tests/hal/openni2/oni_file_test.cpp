#include <OniCAPI.h>
#include <gtest/gtest.h>

#include <random>

#include "hal/openni2/oni_writer.hpp"
#include "hal/openni2/openni2.hpp"
#include "tests/hal/openni2/driver_environment.hpp"
#include "tests/hal/openni2/made_sensor.hpp"
#include "tests/support/shared_data.hpp"

namespace tactus::hal::openni2 {
namespace {

constexpr rt::Duration kPatience{5'000'000'000};

struct Played {
  std::uint64_t depth_count = 0, color_count = 0, corrupt_count = 0;
};

/// To the end of both streams; every read ends by itself.
Played play(Sensor& sensor) {
  Played played;
  const auto pixels = [](const Intrinsics& k) { return static_cast<std::size_t>(k.width) * static_cast<std::size_t>(k.height); };
  std::vector<std::uint16_t> raw(pixels(sensor.calibration.depth));
  std::vector<std::uint8_t> rgb(3 * pixels(sensor.calibration.color));
  FrameHeader header;
  const auto count = [&](rt::Status status, std::uint64_t& good) {
    EXPECT_TRUE(status == rt::Status::ok || status == rt::Status::corrupt || status == rt::Status::end_of_stream);
    ++(status == rt::Status::ok ? good : played.corrupt_count);
  };
  for (rt::Status status; (status = sensor.depth->read(raw, header, kPatience)) != rt::Status::end_of_stream;)
    count(status, played.depth_count);
  if (!sensor.color) return played;
  for (rt::Status status; (status = sensor.color->read(rgb, header, kPatience)) != rt::Status::end_of_stream;)
    count(status, played.color_count);
  return played;
}

class OniFile : public testing::Test {
 protected:
  OniFile() { set_driver(kSource, "1", true); }
  [[nodiscard]] std::filesystem::path file() const { return folder_.path() / "x.oni"; }
  void write(Sensor sensor) const { ASSERT_TRUE(write_oni(file(), sensor)); }
  test::TemporaryFolder folder_;
};

TEST_F(OniFile, Written_ComesBackByteForByteFromTheLibrary) {
  for (const double unit_m : {0.001, 0.0001}) {
    std::filesystem::remove(file());
    write(made_sensor(7, 5, unit_m, 1'305'031'102'175'304'123));
    auto sut = open_oni(file(), {});
    ASSERT_TRUE(sut) << sut.error().message;
    EXPECT_EQ(sut->frames_count, 7U);
    EXPECT_EQ(sut->calibration.depth_m_per_unit, unit_m);
    EXPECT_TRUE(sut->calibration.registered);
    EXPECT_NEAR(sut->calibration.depth.fx, 30, 1e-5);
    std::vector<std::uint16_t> raw(made_depth(0).size());
    std::vector<std::uint8_t> rgb(made_color(0).size());
    FrameHeader header;
    for (unsigned i = 0; i < 7; ++i) {
      ASSERT_EQ(sut->depth->read(raw, header, kPatience), rt::Status::ok);
      EXPECT_TRUE(raw == made_depth(i)) << "frame " << i;
      EXPECT_EQ(header.sequence, i);
      EXPECT_EQ(header.time.ns, (1'305'031'102'175'304'123 + std::int64_t{i} * 33'333'333) / 1000 * 1000);
    }
    EXPECT_EQ(sut->depth->read(raw, header, kPatience), rt::Status::end_of_stream);
    for (unsigned i = 0; i < 5; ++i) {
      ASSERT_EQ(sut->color->read(rgb, header, kPatience), rt::Status::ok);
      EXPECT_TRUE(rgb == made_color(i)) << "frame " << i;
    }
    EXPECT_EQ(sut->color->read(rgb, header, kPatience), rt::Status::end_of_stream);
  }
}

TEST_F(OniFile, OtherUnits_BecomeWholeMillimetres) {
  write(made_sensor(1, 0, 0.0002));
  auto sut = open_oni(file(), {});
  ASSERT_TRUE(sut) << sut.error().message;
  std::vector<std::uint16_t> raw(made_depth(0).size());
  FrameHeader header;
  ASSERT_EQ(sut->depth->read(raw, header, kPatience), rt::Status::ok);
  const auto own = made_depth(0);
  for (std::size_t i = 0; i < raw.size(); ++i) ASSERT_EQ(raw[i], (own[i] + 2) / 5) << i;
}

TEST_F(OniFile, Part_HasItsFramesAndTheirColour) {
  write(made_sensor(9, 9));
  auto sut = open_oni(file(), {.first = 3, .last = 5});
  ASSERT_TRUE(sut) << sut.error().message;
  EXPECT_EQ(sut->frames_count, 2U);
  std::vector<std::uint16_t> raw(made_depth(0).size());
  FrameHeader header;
  ASSERT_EQ(sut->depth->read(raw, header, kPatience), rt::Status::ok);
  EXPECT_EQ(header.sequence, 3U);
  EXPECT_TRUE(raw == made_depth(3));
  const Played rest = play(*sut);
  EXPECT_EQ(rest.depth_count, 1U);
  EXPECT_EQ(rest.color_count, 2U);
  const auto refused = open_oni(file(), {.first = 9});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, rt::ExitCode::bad_usage);
}

TEST_F(OniFile, CutAtItsEnd_PlaysWhatIsWhole) {
  write(made_sensor(4, 4));
  std::filesystem::resize_file(file(), std::filesystem::file_size(file()) - 5);
  auto sut = open_oni(file(), {});
  ASSERT_TRUE(sut) << sut.error().message;
  EXPECT_NE(sut->notes.back().find("cut off"), std::string::npos);
  const Played played = play(*sut);
  EXPECT_EQ(played.depth_count, 4U);
  EXPECT_EQ(played.color_count, 4U);
}

TEST_F(OniFile, WriterThatDidNotFinish_PlaysToItsLastWholeFrame) {
  Sensor sensor = made_sensor(6, 6);
  {
    auto writer = OniWriter::open(file(), sensor);
    ASSERT_TRUE(writer);
    for (int i = 0; i < 3; ++i) ASSERT_TRUE(writer->step());
  }
  std::filesystem::resize_file(file(), std::filesystem::file_size(file()) - 100);
  auto sut = open_oni(file(), {});
  ASSERT_TRUE(sut) << sut.error().message;
  const Played played = play(*sut);
  EXPECT_EQ(played.depth_count, 2U);
  EXPECT_EQ(played.color_count, 2U);
}

TEST_F(OniFile, RealFileCutAnywhere_NeitherHangsNorCrashes) {
  const auto shared = test::shared_data("oni/kinect_v1_12frames.oni");
  if (!shared) GTEST_SKIP() << "the shared recordings are not beside the project";
  std::ifstream in(*shared, std::ios::binary);
  const std::string whole((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  for (const std::size_t bytes : {std::size_t{10}, std::size_t{500}, std::size_t{31'300}, std::size_t{200'000},
                                  std::size_t{1'000'000}, whole.size() - 300, whole.size() - 28, whole.size() - 1}) {
    folder_.write("x.oni", std::string_view(whole).substr(0, bytes));
    auto sut = open_oni(file(), {});
    if (!sut) {
      EXPECT_EQ(sut.error().code, rt::ExitCode::bad_input) << bytes;
      continue;
    }
    const Played played = play(*sut);
    EXPECT_EQ(played.depth_count, 12U);
    EXPECT_EQ(played.color_count, 12U);
  }
}

TEST_F(OniFile, DamagedHeads_NeitherHangNorCrash) {
  write(made_sensor(3, 3));
  const std::string whole = folder_.read("x.oni");
  constexpr unsigned kSeed = 5;
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  std::mt19937 random(kSeed);
  int refused_count = 0;
  for (int round = 0; round < 60; ++round) {
    std::string bytes = whole;
    bytes[random() % 2600] ^= static_cast<char>(1U << random() % 8);
    folder_.write("x.oni", bytes);
    auto sut = open_oni(file(), {});
    if (!sut) {
      ++refused_count;
      EXPECT_EQ(sut.error().code, rt::ExitCode::bad_input) << sut.error().message;
      continue;
    }
    EXPECT_LE(play(*sut).depth_count, 3U);
  }
  EXPECT_GT(refused_count, 0);
}

}  // namespace
}  // namespace tactus::hal::openni2
