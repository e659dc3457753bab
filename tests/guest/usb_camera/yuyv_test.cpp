#include "tests/guest/usb_camera/yuyv.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <random>
#include <vector>

#include "hal/frames/convert.hpp"

namespace tactus::guest {
namespace {

using Pair = std::array<std::uint8_t, 4>;

Pair pair_of(std::array<std::uint8_t, 6> rgb) {
  Pair yuyv{};
  to_yuyv(rgb, yuyv);
  return yuyv;
}

TEST(Yuyv, BlackWhiteAndTheCornersOfTheCubeAreThoseOfBt601) {
  EXPECT_EQ(pair_of({0, 0, 0, 255, 255, 255}), (Pair{16, 128, 235, 128}));
  EXPECT_EQ(pair_of({255, 0, 0, 255, 0, 0}), (Pair{81, 90, 81, 240}));
  EXPECT_EQ(pair_of({0, 255, 0, 0, 255, 0}), (Pair{145, 54, 145, 34}));
  EXPECT_EQ(pair_of({0, 0, 255, 0, 0, 255}), (Pair{41, 240, 41, 110}));
}

TEST(Yuyv, EveryPairIsWithinHalfAStepOfTheExactMatrix) {
  const unsigned seed = 9;
  std::mt19937 random(seed);
  for (int i = 0; i < 20'000; ++i) {
    std::array<std::uint8_t, 6> rgb{};
    for (std::uint8_t& value : rgb) value = static_cast<std::uint8_t>(random());
    const Pair got = pair_of(rgb);
    const auto exact = [&](std::size_t pixel, double r, double g, double b) {
      return r * rgb[3 * pixel] + g * rgb[3 * pixel + 1] + b * rgb[3 * pixel + 2];
    };
    // 0.01 beyond half a step: the matrix is rounded to 2^-16.
    for (const std::size_t pixel : {std::size_t{0}, std::size_t{1}}) {
      const double y = 16 + 219.0 / 255 * exact(pixel, 0.299, 0.587, 0.114);
      EXPECT_NEAR(got[2 * pixel], y, 0.51) << "seed " << seed << ", pair " << i;
    }
    const auto mean = [&](double r, double g, double b) { return (exact(0, r, g, b) + exact(1, r, g, b)) / 2; };
    const double u = 128 + 224.0 / 255 * mean(-0.299 / 1.772, -0.587 / 1.772, 0.5);
    const double v = 128 + 224.0 / 255 * mean(0.5, -0.587 / 1.402, -0.114 / 1.402);
    EXPECT_NEAR(got[1], u, 0.51) << "seed " << seed << ", pair " << i;
    EXPECT_NEAR(got[3], v, 0.51) << "seed " << seed << ", pair " << i;
  }
}

TEST(Yuyv, BackToRgbAPairOfOneColourIsNearlyItself) {
  // A step of chroma is 2 of blue, and each rounding costs half a step.
  constexpr int kSide = 16;
  int most = 0;
  for (int r = 0; r < 256; r += 255 / (kSide - 1))
    for (int g = 0; g < 256; g += 255 / (kSide - 1))
      for (int b = 0; b < 256; b += 255 / (kSide - 1)) {
        const std::array<std::uint8_t, 3> color{static_cast<std::uint8_t>(r), static_cast<std::uint8_t>(g),
                                                static_cast<std::uint8_t>(b)};
        const Pair yuyv = pair_of({color[0], color[1], color[2], color[0], color[1], color[2]});
        std::array<std::uint8_t, 6> back{};
        hal::RawFrame frame;
        frame.format = hal::PixelFormat::yuyv;
        frame.width = 2;
        frame.height = 1;
        frame.row_bytes = 4;
        frame.bytes = yuyv;
        ASSERT_EQ(hal::frames::to_rgb(frame, back), rt::Status::ok);
        for (std::size_t i = 0; i < 6; ++i) most = std::max(most, std::abs(back[i] - color[i % 3]));
      }
  EXPECT_LE(most, 3);
}

}  // namespace
}  // namespace tactus::guest
