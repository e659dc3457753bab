#include "hal/replay/image_codec.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "tests/hal/replay/recording_folder.hpp"

namespace tactus::hal::replay {
namespace {

std::string depth_png(unsigned seed) {
  const test::TemporaryFolder folder;
  EXPECT_TRUE(write_depth_png(folder.path() / "d.png", depth_image(seed), kWidth, kHeight));
  return folder.read("d.png");
}

/// A smooth picture, as JPEG is made for.
std::vector<std::uint8_t> smooth_image() {
  std::vector<std::uint8_t> out;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      for (const int value : {x * 6, y * 8, 255 - x * 3 - y * 3})
        out.push_back(static_cast<std::uint8_t>(value));
  return out;
}

std::string color_jpeg(int quality) {
  const test::TemporaryFolder folder;
  EXPECT_TRUE(write_color_jpeg(folder.path() / "c.jpg", smooth_image(), kWidth, kHeight, quality));
  return folder.read("c.jpg");
}

std::string try_depth(std::string_view bytes) {
  std::vector<std::uint16_t> out(kPixels);
  return decode_depth(bytes, kWidth, kHeight, out);
}

TEST(ImageCodec, DepthComesBackExactly) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    std::vector<std::uint16_t> out(kPixels);
    EXPECT_EQ(decode_depth(depth_png(seed), kWidth, kHeight, out), "");
    EXPECT_EQ(out, depth_image(seed));
  }
}

TEST(ImageCodec, PngColourAndLabelsComeBackExactly) {
  const test::TemporaryFolder folder;
  const auto rgb = bytes_image(kPixels * 3, 1), ids = bytes_image(kPixels, 2);
  ASSERT_TRUE(write_color_png(folder.path() / "c.png", rgb, kWidth, kHeight));
  ASSERT_TRUE(write_label_png(folder.path() / "l.png", ids, kWidth, kHeight));
  std::vector<std::uint8_t> rgb_out(rgb.size()), ids_out(ids.size());
  EXPECT_EQ(decode_color(folder.read("c.png"), kWidth, kHeight, rgb_out), "");
  EXPECT_EQ(decode_label(folder.read("l.png"), kWidth, kHeight, ids_out), "");
  EXPECT_EQ(rgb_out, rgb);
  EXPECT_EQ(ids_out, ids);
}

TEST(ImageCodec, JpegComesBackNearlyAndInRgbOrder) {
  const auto rgb = smooth_image();
  std::vector<std::uint8_t> out(rgb.size());
  ASSERT_EQ(decode_color(color_jpeg(95), kWidth, kHeight, out), "");
  double sum = 0;
  for (std::size_t i = 0; i < rgb.size(); ++i) sum += std::fabs(double{1} * rgb[i] - out[i]);
  EXPECT_LT(sum / static_cast<double>(rgb.size()), 2.0);
}

TEST(ImageCodec, GreyColourImageFillsAllThreeChannels) {
  const test::TemporaryFolder folder;
  const auto grey = bytes_image(kPixels, 3);
  ASSERT_TRUE(write_label_png(folder.path() / "g.png", grey, kWidth, kHeight));
  std::vector<std::uint8_t> out(kPixels * 3);
  ASSERT_EQ(decode_color(folder.read("g.png"), kWidth, kHeight, out), "");
  for (std::size_t i = 0; i < out.size(); ++i) EXPECT_EQ(out[i], grey[i / 3]);
}

TEST(ImageCodec, EveryTruncationIsRefused) {
  const std::string png = depth_png(1);
  for (std::size_t bytes = 0; bytes < png.size(); bytes += 7)
    EXPECT_NE(try_depth(std::string_view(png).substr(0, bytes)), "") << bytes << " of " << png.size();
  const std::string jpeg = color_jpeg(90);
  std::vector<std::uint8_t> out(kPixels * 3);
  for (std::size_t bytes = 0; bytes < jpeg.size(); ++bytes)
    EXPECT_NE(decode_color(std::string_view(jpeg).substr(0, bytes), kWidth, kHeight, out), "")
        << bytes << " of " << jpeg.size();
}

TEST(ImageCodec, FlippedBitsNeverChangeDepthSilently) {
  const std::string png = depth_png(2);
  const auto truth = depth_image(2);
  std::vector<std::uint16_t> out(kPixels);
  int refused_count = 0;
  for (std::size_t bit = 0; bit < png.size() * 8; bit += 11) {
    std::string spoilt = png;
    spoilt[bit / 8] = static_cast<char>(spoilt[bit / 8] ^ (1 << bit % 8));
    if (decode_depth(spoilt, kWidth, kHeight, out).empty()) {
      EXPECT_EQ(out, truth) << "bit " << bit;
    } else {
      ++refused_count;
    }
  }
  EXPECT_GT(refused_count, 1000);
}

TEST(ImageCodec, LyingImagesSayWhatTheyAre) {
  const test::TemporaryFolder folder;
  ASSERT_TRUE(write_label_png(folder.path() / "l.png", bytes_image(kPixels, 1), kWidth, kHeight));
  ASSERT_TRUE(write_color_png(folder.path() / "c.png", bytes_image(kPixels * 3, 1), kWidth, kHeight));
  EXPECT_EQ(try_depth(folder.read("l.png")),
            "a PNG of 8 bits and 1 channels; depth is a 16-bit greyscale PNG");
  EXPECT_EQ(try_depth(folder.read("c.png")),
            "a PNG of 8 bits and 3 channels; depth is a 16-bit greyscale PNG");
  EXPECT_EQ(try_depth(color_jpeg(90)), "a JPEG of 8 bits and 3 channels; depth is a 16-bit greyscale PNG");
  EXPECT_EQ(try_depth("not an image"), "neither PNG nor JPEG");
  EXPECT_EQ(try_depth(""), "the file is empty");
  std::vector<std::uint8_t> ids(kPixels), rgb(kPixels * 3);
  EXPECT_EQ(decode_label(depth_png(1), kWidth, kHeight, ids),
            "a PNG of 16 bits and 1 channels; labels are an 8-bit greyscale PNG");
  EXPECT_EQ(decode_color(depth_png(1), kWidth, kHeight, rgb),
            "a PNG of 16 bits and 1 channels; colour is PNG or JPEG with 8 bits per channel");
  std::vector<std::uint16_t> larger(kPixels * 2);
  EXPECT_EQ(decode_depth(depth_png(1), kWidth * 2, kHeight, larger),
            "40x30 pixels, but the calibration says 80x30");
}

TEST(ImageHeader, AbsurdSizesAreRefusedBeforeDecoding) {
  std::string png = depth_png(1);
  for (const std::size_t i : {16U, 17U, 18U, 19U}) png[i] = '\x7f';
  EXPECT_EQ(try_depth(png), "2139062143x30 pixels, but the calibration says 40x30");
  const auto header = parse_image_header(png);
  ASSERT_TRUE(header.has_value());
  EXPECT_EQ(fault_of(*header, ImageUse::depth, 0, 0),
            "2139062143x30 pixels is no image size; at most 8192 a side, 16 Mpixel together");
}

TEST(ImageHeader, IllegalPngHeadersAreRefused) {
  const auto message = [](const std::string& bytes) {
    const auto header = parse_image_header(bytes);
    return header ? std::string("accepted") : header.error().message;
  };
  std::string png = depth_png(1);
  EXPECT_EQ(message(png.substr(0, 20)), "truncated inside the PNG header");
  std::string spoilt = png;
  spoilt[12] = 'X';
  EXPECT_EQ(message(spoilt), "a PNG whose first chunk is not IHDR");
  spoilt = png;
  spoilt[25] = 5;
  EXPECT_EQ(message(spoilt), "a PNG of no known colour type");
  spoilt = png;
  spoilt[24] = 12;
  EXPECT_EQ(message(spoilt), "a PNG of 12 bits, which its colour type does not allow");
}

}  // namespace
}  // namespace tactus::hal::replay
