#include "pipeline/render/png.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <random>

#include "tests/pipeline/render/picture.hpp"

namespace tactus::render {
namespace {

test::Picture random_picture(int width_px, int height_px) {
  std::mt19937 random(5);
  test::Picture picture(width_px, height_px);
  for (auto& value : picture.rgb) value = static_cast<std::uint8_t>(random());
  return picture;
}

TEST(Png, WrittenPictureReadsBackTheSame) {
  const test::Picture picture = random_picture(37, 21);
  const auto path = std::filesystem::path(testing::TempDir()) / "tactus_png_test.png";
  const auto written = write_png(path, picture.rgb, 37, 21);
  ASSERT_TRUE(written) << written.error().message;
  const auto back = test::read_png(path);
  ASSERT_TRUE(back.has_value());
  EXPECT_EQ(back->width_px, 37);
  EXPECT_EQ(back->rgb, picture.rgb);
  std::filesystem::remove(path);
}

TEST(Png, EncodedBytesAreTheBytesOfTheFile) {
  const test::Picture picture = random_picture(16, 16);
  const auto path = std::filesystem::path(testing::TempDir()) / "tactus_png_encode_test.png";
  ASSERT_TRUE(write_png(path, picture.rgb, 16, 16));
  const auto encoded = encode_png(picture.rgb, 16, 16);
  ASSERT_TRUE(encoded) << encoded.error().message;
  std::ifstream file(path, std::ios::binary);
  const std::vector<char> bytes{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  ASSERT_EQ(bytes.size(), encoded->size());
  EXPECT_TRUE(std::equal(bytes.begin(), bytes.end(), encoded->begin(),
                         [](char a, std::uint8_t b) { return static_cast<std::uint8_t>(a) == b; }));
  std::filesystem::remove(path);
}

TEST(Png, UnwritablePathIsNamedInTheError) {
  const test::Picture picture(4, 4);
  const auto written = write_png("/nowhere/at/all.png", picture.rgb, 4, 4);
  ASSERT_FALSE(written);
  EXPECT_NE(written.error().message.find("/nowhere/at/all.png"), std::string::npos)
      << written.error().message;
}

}  // namespace
}  // namespace tactus::render
