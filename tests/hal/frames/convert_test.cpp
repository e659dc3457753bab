#include "hal/frames/convert.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "hal/frames/jpeg_codec.hpp"

namespace tactus::hal::frames {
namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes random_bytes(std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  Bytes out(count);
  for (auto& byte : out) byte = static_cast<std::uint8_t>(random());
  return out;
}

/// BT.601 as its text has it, in double: luma 16..235, chroma 16..240 around 128, Kr 0.299, Kb 0.114.
std::array<double, 3> rgb_of(double y, double u, double v) {
  constexpr double kRed = 0.299, kBlue = 0.114, kGreen = 1 - kRed - kBlue;
  const double luma = (y - 16) / 219, pb = (u - 128) / 224, pr = (v - 128) / 224;
  const double red = luma + 2 * (1 - kRed) * pr;
  const double blue = luma + 2 * (1 - kBlue) * pb;
  const double green = (luma - kRed * red - kBlue * blue) / kGreen;
  const auto level = [](double share) { return std::clamp(255 * share, 0.0, 255.0); };
  return {level(red), level(green), level(blue)};
}

void expect_near(const std::uint8_t* rgb, const std::array<double, 3>& expected) {
  for (std::size_t c = 0; c < 3; ++c) ASSERT_NEAR(rgb[c], expected[c], 1) << "channel " << c;
}

RawFrame frame_of(PixelFormat format, int width, int height, std::size_t row_bytes, const Bytes& bytes) {
  return {{}, format, width, height, row_bytes, bytes};
}

/// One pair with every luma in its first pixel's place.
TEST(Convert, YuyvOfEveryLumaAndChromaIsNearTheStandard) {
  constexpr int kWidth = 512;
  Bytes bytes(2 * kWidth);
  std::vector<std::uint8_t> rgb(3 * kWidth);
  for (int u = 0; u < 256; u += 5)
    for (int v = 0; v < 256; v += 5) {
      for (std::size_t i = 0; i < kWidth / 2; ++i) {
        bytes[4 * i] = static_cast<std::uint8_t>(i);
        bytes[4 * i + 1] = static_cast<std::uint8_t>(u);
        bytes[4 * i + 2] = static_cast<std::uint8_t>(255 - i);
        bytes[4 * i + 3] = static_cast<std::uint8_t>(v);
      }
      ASSERT_EQ(to_rgb(frame_of(PixelFormat::yuyv, kWidth, 1, 2 * kWidth, bytes), rgb), rt::Status::ok);
      for (std::size_t i = 0; i < kWidth / 2; ++i) {
        expect_near(&rgb[6 * i], rgb_of(static_cast<double>(i), u, v));
        expect_near(&rgb[6 * i + 3], rgb_of(static_cast<double>(255 - i), u, v));
      }
    }
}

TEST(Convert, Nv12TakesChromaOfTheBlockWithAndWithoutPadding) {
  constexpr int kWidth = 14, kHeight = 6;
  for (const std::size_t row_bytes : {std::size_t{14}, std::size_t{17}, std::size_t{32}}) {
    const Bytes bytes = random_bytes(row_bytes * 9, 3);
    std::vector<std::uint8_t> rgb(3 * kWidth * kHeight);
    ASSERT_EQ(to_rgb(frame_of(PixelFormat::nv12, kWidth, kHeight, row_bytes, bytes), rgb), rt::Status::ok);
    for (std::size_t y = 0; y < kHeight; ++y)
      for (std::size_t x = 0; x < kWidth; ++x) {
        const std::size_t chroma = (kHeight + y / 2) * row_bytes + x / 2 * 2;
        expect_near(&rgb[3 * (y * kWidth + x)],
                    rgb_of(bytes[y * row_bytes + x], bytes[chroma], bytes[chroma + 1]));
      }
  }
}

TEST(Convert, PaddingBetweenRowsLeavesNoTrace) {
  constexpr int kWidth = 10, kHeight = 7;
  for (const PixelFormat format : {PixelFormat::rgb24, PixelFormat::yuyv}) {
    const std::size_t row = format == PixelFormat::rgb24 ? 3 * kWidth : 2 * kWidth, wide = row + 13;
    const Bytes packed = random_bytes(row * kHeight, 5);
    Bytes padded(wide * kHeight, 0xEE);
    for (std::size_t y = 0; y < kHeight; ++y)
      std::copy_n(packed.begin() + static_cast<std::ptrdiff_t>(y * row), row,
                  padded.begin() + static_cast<std::ptrdiff_t>(y * wide));
    padded.resize(wide * (kHeight - 1) + row);  // the last row without its padding, as drivers give it
    std::vector<std::uint8_t> of_packed(3 * kWidth * kHeight), of_padded(of_packed.size());
    ASSERT_EQ(to_rgb(frame_of(format, kWidth, kHeight, row, packed), of_packed), rt::Status::ok);
    ASSERT_EQ(to_rgb(frame_of(format, kWidth, kHeight, wide, padded), of_padded), rt::Status::ok);
    EXPECT_EQ(of_packed, of_padded);
    if (format == PixelFormat::rgb24) {
      EXPECT_EQ(of_packed, packed);
    }
  }
}

TEST(Convert, DepthKeepsEveryValueButTheSaturatedOne) {
  constexpr int kWidth = 257, kHeight = 255;  // 65535 values: 1 .. 65535
  for (const std::size_t padding : {std::size_t{0}, std::size_t{6}}) {
    const std::size_t row = 2 * kWidth + padding;
    Bytes bytes(row * kHeight, 0x11);
    for (std::size_t i = 0; i < kWidth * kHeight; ++i) {
      bytes[i / kWidth * row + i % kWidth * 2] = static_cast<std::uint8_t>(i + 1);
      bytes[i / kWidth * row + i % kWidth * 2 + 1] = static_cast<std::uint8_t>((i + 1) >> 8);
    }
    std::vector<std::uint16_t> depth(kWidth * kHeight, 9);
    ASSERT_EQ(to_depth(frame_of(PixelFormat::depth16, kWidth, kHeight, row, bytes), depth), rt::Status::ok);
    for (std::size_t i = 0; i < depth.size(); ++i) ASSERT_EQ(depth[i], i + 1 == 65535 ? 0 : i + 1);
  }
}

TEST(Convert, ShortFramesAreCorruptAndUntouchedPixelsStay) {
  struct Case {
    PixelFormat format;
    int width, height;
    std::size_t row_bytes, bytes_needed;
  };
  for (const Case& c : {Case{PixelFormat::depth16, 5, 3, 10, 30}, Case{PixelFormat::depth16, 5, 3, 16, 42},
                        Case{PixelFormat::rgb24, 5, 3, 15, 45}, Case{PixelFormat::yuyv, 6, 3, 12, 36},
                        Case{PixelFormat::nv12, 6, 4, 6, 36}, Case{PixelFormat::nv12, 6, 4, 8, 46}}) {
    const auto pixels = static_cast<std::size_t>(c.width * c.height);
    std::vector<std::uint16_t> depth(pixels, 7);
    std::vector<std::uint8_t> rgb(3 * pixels, 7);
    const auto convert = [&](const RawFrame& frame) {
      return c.format == PixelFormat::depth16 ? to_depth(frame, depth) : to_rgb(frame, rgb);
    };
    const Bytes whole = random_bytes(c.bytes_needed, 1);
    const Bytes torn(whole.begin(), whole.end() - 1);
    EXPECT_FALSE(is_whole(frame_of(c.format, c.width, c.height, c.row_bytes, torn)));
    EXPECT_EQ(convert(frame_of(c.format, c.width, c.height, c.row_bytes, torn)), rt::Status::corrupt);
    EXPECT_EQ(convert(frame_of(c.format, c.width, c.height, 0, whole)), rt::Status::corrupt) << "rows overlap";
    EXPECT_EQ(convert(frame_of(c.format, c.width, c.height, c.row_bytes, {})), rt::Status::corrupt);
    EXPECT_EQ(std::count(depth.begin(), depth.end(), 7), static_cast<std::ptrdiff_t>(pixels));
    EXPECT_EQ(std::count(rgb.begin(), rgb.end(), 7), static_cast<std::ptrdiff_t>(3 * pixels));
    EXPECT_EQ(convert(frame_of(c.format, c.width, c.height, c.row_bytes, whole)), rt::Status::ok);
  }
}

TEST(Convert, OddSizesOfPairedFormatsAreCorrupt) {
  const Bytes plenty(400, 100);
  std::vector<std::uint8_t> rgb(3 * 5 * 4);
  EXPECT_EQ(to_rgb(frame_of(PixelFormat::yuyv, 5, 4, 12, plenty), rgb), rt::Status::corrupt);
  EXPECT_EQ(to_rgb(frame_of(PixelFormat::nv12, 5, 4, 6, plenty), rgb), rt::Status::corrupt);
  rgb.resize(3 * 4 * 5);
  EXPECT_EQ(to_rgb(frame_of(PixelFormat::nv12, 4, 5, 4, plenty), rgb), rt::Status::corrupt);
  EXPECT_EQ(to_rgb(frame_of(PixelFormat::yuyv, 4, 5, 8, plenty), rgb), rt::Status::ok) << "rows need no pair";
}

TEST(Convert, FormatsOfTheOtherCameraAreUnsupported) {
  const Bytes bytes(64, 1);
  std::vector<std::uint8_t> rgb(3 * 8);
  std::vector<std::uint16_t> depth(8);
  EXPECT_EQ(to_rgb(frame_of(PixelFormat::depth16, 4, 2, 8, bytes), rgb), rt::Status::unsupported);
  EXPECT_EQ(to_depth(frame_of(PixelFormat::yuyv, 4, 2, 8, bytes), depth), rt::Status::unsupported);
}

TEST(Convert, MjpegGivesWhatTheDecoderGivesAndRefusesDamage) {
  constexpr int kWidth = 16, kHeight = 8;
  const Bytes pixels = random_bytes(3 * kWidth * kHeight, 8);
  Bytes jpeg;
  ASSERT_TRUE(encode_jpeg(pixels, kWidth, kHeight, 90, jpeg));
  std::vector<std::uint8_t> expected(pixels.size()), rgb(pixels.size());
  ASSERT_EQ(decode_jpeg({reinterpret_cast<const char*>(jpeg.data()), jpeg.size()}, kWidth, kHeight, expected), "");
  EXPECT_EQ(to_rgb(frame_of(PixelFormat::mjpeg, kWidth, kHeight, 0, jpeg), rgb), rt::Status::ok);
  EXPECT_EQ(rgb, expected);
  // Webcams put bytes of no meaning before the end mark.
  std::vector<std::uint8_t> webcam(jpeg.begin(), jpeg.end() - 2);
  webcam.insert(webcam.end(), {0x00, 0x12, 0x34, 0x56, 0xFF, 0xD9});
  std::vector<std::uint8_t> from_webcam(rgb.size());
  EXPECT_EQ(to_rgb(frame_of(PixelFormat::mjpeg, kWidth, kHeight, 0, webcam), from_webcam), rt::Status::ok);
  EXPECT_EQ(from_webcam, rgb);
  EXPECT_NE(decode_jpeg({reinterpret_cast<const char*>(webcam.data()), webcam.size()}, kWidth, kHeight, expected), "")
      << "in a file they are damage";
  EXPECT_FALSE(is_whole(frame_of(PixelFormat::mjpeg, kWidth, kHeight, 0, {})));
  jpeg.resize(jpeg.size() / 2);
  EXPECT_EQ(to_rgb(frame_of(PixelFormat::mjpeg, kWidth, kHeight, 0, jpeg), rgb), rt::Status::corrupt);
}

TEST(Convert, PackedBytesIsWhatAWholeFrameNeeds) {
  EXPECT_EQ(packed_bytes(PixelFormat::depth16, 640, 480), 614'400U);
  EXPECT_EQ(packed_bytes(PixelFormat::rgb24, 640, 480), 921'600U);
  EXPECT_EQ(packed_bytes(PixelFormat::yuyv, 640, 480), 614'400U);
  EXPECT_EQ(packed_bytes(PixelFormat::nv12, 640, 480), 460'800U);
  EXPECT_EQ(packed_bytes(PixelFormat::mjpeg, 640, 480), 0U);
}

TEST(Convert, PixelsShownAsTheyAreComeBack) {
  const std::vector<std::uint16_t> depth{1, 2, 3, 40000, 0, 6};
  const FrameHeader header{{5}, 6, {7}};
  std::vector<std::uint16_t> depth_back(6);
  const RawFrame shown = raw_frame(depth, header, 3, 2);
  EXPECT_EQ(shown.header.sequence, 6U);
  ASSERT_EQ(to_depth(shown, depth_back), rt::Status::ok);
  EXPECT_EQ(depth_back, depth);
  const Bytes rgb = random_bytes(18, 2);
  Bytes rgb_back(18);
  ASSERT_EQ(to_rgb(raw_frame(rgb, header, 3, 2), rgb_back), rt::Status::ok);
  EXPECT_EQ(rgb_back, rgb);
}

}  // namespace
}  // namespace tactus::hal::frames
