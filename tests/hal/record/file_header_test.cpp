#include "hal/record/file_header.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>

namespace tactus::hal::record {
namespace {

FileHeader example() {
  FileHeader out;
  out.description = "a camera";
  out.calibration.depth = {640, 480, 585.3, 586.1, 320.25, 240.75, 0.1, -0.2, 1e-5, -3e-7, 0.02};
  out.calibration.depth_m_per_unit = 0.0001;
  out.calibration.has_color = true;
  out.calibration.color = {1280, 720, 900, 901, 640, 360, 0, 0, 0, 0, 0};
  out.calibration.T_color_depth.translation = {-0.025, 1e-17, -0.0};
  out.gravity_depth = Vec3d{0, 1, 0};
  out.was_live = true;
  out.info.entries = {{"source", "depth:/dev/video0"}, {"command", "tactus record \"a b\" \\ \t\n"}, {"source", "twice"}};
  return out;
}

TEST(FileHeader, EverythingReadsBack) {
  const FileHeader expected = example();
  const std::string text = format_file_header(expected);
  const auto got = parse_file_header(text, "x.tac");
  ASSERT_TRUE(got) << got.error().message << "\n" << text;
  EXPECT_EQ(got->description, expected.description);
  EXPECT_EQ(got->calibration.depth, expected.calibration.depth);
  EXPECT_EQ(got->calibration.color, expected.calibration.color);
  EXPECT_EQ(got->calibration.T_color_depth.translation, expected.calibration.T_color_depth.translation);
  EXPECT_TRUE(std::signbit(got->calibration.T_color_depth.translation.z)) << "-0 too";
  EXPECT_EQ(got->info, expected.info);
  EXPECT_TRUE(got->was_live);
  EXPECT_FALSE(got->has_two_clocks);
  ASSERT_TRUE(got->gravity_depth);
  EXPECT_EQ(*got->gravity_depth, *expected.gravity_depth);
  EXPECT_EQ(format_file_header(*got), text);
}

TEST(FileHeader, AnyFiniteNumberReadsBackToTheSameBits) {
  constexpr unsigned kSeed = 12;
  std::mt19937_64 random(kSeed);
  FileHeader header = example();
  for (int i = 0; i < 1000; ++i) {
    std::array<double, 3> values{5e-324, -std::numeric_limits<double>::max(), 4.35};
    for (double& value : values) {
      if (i == 0) break;
      const double any = std::bit_cast<double>(random());
      value = std::isfinite(any) ? any : static_cast<double>(i);
    }
    header.calibration.depth.k1 = values[0];
    header.calibration.depth.cx = values[1];
    header.calibration.T_color_depth.translation.x = values[2];
    const auto got = parse_file_header(format_file_header(header), "x");
    ASSERT_TRUE(got) << got.error().message;
    ASSERT_EQ(std::bit_cast<std::uint64_t>(got->calibration.depth.k1), std::bit_cast<std::uint64_t>(values[0]))
        << "seed " << kSeed;
    ASSERT_EQ(std::bit_cast<std::uint64_t>(got->calibration.depth.cx), std::bit_cast<std::uint64_t>(values[1]));
    ASSERT_EQ(std::bit_cast<std::uint64_t>(got->calibration.T_color_depth.translation.x),
              std::bit_cast<std::uint64_t>(values[2]));
  }
}

TEST(FileHeader, WordsOfAllScriptsReadBackAndStrayBytesBecomeQuestionMarks) {
  FileHeader header = example();
  header.info.entries = {{"\u00e9\u4e2d\U0001F600", "\x7f"}, {"\xff", "a\xc3"}, {"\xed\xa0\x80", "\xc0\xaf"}, {"", ""}};
  const std::string text = format_file_header(header);
  for (const char c : text) ASSERT_LT(static_cast<unsigned char>(c), 128);
  const auto got = parse_file_header(text, "x");
  ASSERT_TRUE(got) << got.error().message;
  EXPECT_EQ(got->info.entries[0], header.info.entries[0]);
  EXPECT_EQ(got->info.entries[1], std::pair(std::string("?"), std::string("a?")));
  EXPECT_EQ(got->info.entries[2], std::pair(std::string("???"), std::string("??")));
  EXPECT_EQ(got->info.entries[3], header.info.entries[3]);
}

TEST(FileHeader, DepthAloneNeedsNoColour) {
  FileHeader header = example();
  header.calibration.has_color = false;
  const auto got = parse_file_header(format_file_header(header), "x");
  ASSERT_TRUE(got);
  EXPECT_FALSE(got->calibration.has_color);
  EXPECT_EQ(got->calibration.depth, header.calibration.depth);
}

TEST(FileHeader, WhatNoCameraCanBeIsRefusedInOneSentence) {
  struct Case {
    const char *from, *to, *says;
  };
  for (const Case& c : {Case{"width = 640", "width = 0", "depth.width"}, Case{"width = 640", "width = 8193", "depth.width"},
                        Case{"height = 480", "height = 480.0", "depth.height"},
                        Case{"585.3", "-1.0", "focal"}, Case{"585.3", "nan", "depth.fx_fy_cx_cy"},
                        Case{"m_per_unit = 1e-04", "m_per_unit = 0", "depth.m_per_unit"},
                        Case{"frame_rate_hz = 30.0", "", "frame_rate_hz"},
                        Case{"registered = false", "registered = true", "color.width"},
                        Case{"from_depth_rotation = [1.0", "from_depth_rotation = [2.0", "rotation"},
                        Case{"gravity_depth = [0.0, 1.0", "gravity_depth = [0.0, 2.0", "gravity_depth"},
                        Case{"[depth]", "[deep]", "depth must be a table"}, Case{"[depth]", "[depth", "TOML"},
                        Case{"[\"source\", \"twice\"]", "[1, 2]", "info"}}) {
    std::string text = format_file_header(example());
    const std::size_t at = text.find(c.from);
    ASSERT_NE(at, std::string::npos) << c.from;
    text.replace(at, std::strlen(c.from), c.to);
    const auto got = parse_file_header(text, "x.tac");
    ASSERT_FALSE(got) << c.to;
    EXPECT_EQ(got.error().code, rt::ExitCode::bad_input);
    EXPECT_EQ(got.error().message.rfind("x.tac", 0), 0U) << got.error().message;
    EXPECT_NE(got.error().message.find(c.says), std::string::npos) << got.error().message;
  }
}

TEST(FileHeader, KeysOfALaterProgramArePassedOver) {
  const auto got = parse_file_header("later = 3\n" + format_file_header(example()), "x");
  EXPECT_TRUE(got);
}

}  // namespace
}  // namespace tactus::hal::record
