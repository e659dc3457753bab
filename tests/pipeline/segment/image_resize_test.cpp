#include "pipeline/segment/image_resize.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/pipeline/segment/model_builder.hpp"

namespace tactus::segment {
namespace {

std::vector<std::uint8_t> resized(const std::vector<std::uint8_t>& image, int sw, int sh, int w, int h) {
  const test::Memory memory(ImageResizer::bytes_needed(sw, sh, w, h));
  rt::Slice slice = memory.slice();
  ImageResizer sut(sw, sh, w, h, slice);
  std::vector<std::uint8_t> out(static_cast<std::size_t>(w) * static_cast<std::size_t>(h) * 3);
  for (int y = 0; y < h; ++y)
    sut.row(image, y,
            std::span(out).subspan(static_cast<std::size_t>(y) * static_cast<std::size_t>(w) * 3,
                                   static_cast<std::size_t>(w) * 3));
  return out;
}

/// The triangle filter in doubles.
double oracle(const std::vector<std::uint8_t>& image, int sw, int sh, int w, int h, int x, int y, int c) {
  const auto weights = [](int source, int length, int i) {
    const double ratio = static_cast<double>(source) / length, reach = std::max(ratio, 1.0);
    const double center = (i + 0.5) * ratio - 0.5;
    std::vector<double> out(static_cast<std::size_t>(source));
    double sum = 0;
    for (int s = 0; s < source; ++s)
      sum += out[static_cast<std::size_t>(s)] = std::max(0.0, 1 - std::abs(s - center) / reach);
    for (double& v : out) v /= sum;
    return out;
  };
  const auto wx = weights(sw, w, x), wy = weights(sh, h, y);
  double sum = 0;
  for (int yy = 0; yy < sh; ++yy)
    for (int xx = 0; xx < sw; ++xx)
      sum += wy[static_cast<std::size_t>(yy)] * wx[static_cast<std::size_t>(xx)] *
             image[static_cast<std::size_t>((yy * sw + xx) * 3 + c)];
  return sum;
}

TEST(ImageResizer, AgreesWithDoublesWithinOneStep) {
  std::mt19937 random(5);
  for (const auto& [sw, sh, w, h] :
       {std::array{40, 30, 32, 32}, std::array{7, 5, 32, 16}, std::array{64, 48, 9, 7},
        std::array{1, 1, 4, 4}, std::array{33, 1, 8, 1}, std::array{20, 20, 20, 20}}) {
    std::vector<std::uint8_t> image(static_cast<std::size_t>(sw * sh * 3));
    for (std::uint8_t& v : image) v = static_cast<std::uint8_t>(random());
    const std::vector<std::uint8_t> sut = resized(image, sw, sh, w, h);
    for (int y = 0; y < h; ++y)
      for (int x = 0; x < w; ++x)
        for (int c = 0; c < 3; ++c)
          ASSERT_NEAR(sut[static_cast<std::size_t>((y * w + x) * 3 + c)],
                      oracle(image, sw, sh, w, h, x, y, c), 0.75)
              << sw << "x" << sh << " to " << w << "x" << h << " at " << x << "," << y;
  }
}

TEST(ImageResizer, SameSizeIsTheIdentity) {
  std::mt19937 random(6);
  std::vector<std::uint8_t> image(24 * 18 * 3);
  for (std::uint8_t& v : image) v = static_cast<std::uint8_t>(random());
  EXPECT_EQ(resized(image, 24, 18, 24, 18), image);
}

TEST(ImageResizer, UniformColourStaysExactlyThatColour) {
  for (const int value : {0, 1, 127, 254, 255})
    for (const auto& [w, h] : {std::pair{512, 512}, std::pair{257, 257}, std::pair{31, 17}}) {
      const std::vector<std::uint8_t> image(640 * 480 * 3, static_cast<std::uint8_t>(value));
      for (const std::uint8_t v : resized(image, 640, 480, w, h)) ASSERT_EQ(v, value);
    }
}

}  // namespace
}  // namespace tactus::segment
