#include "hal/egl/letterbox.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace tactus::hal::egl {
namespace {

TEST(Letterbox, WindowOfThePicturesSizeShowsItPixelByPixel) {
  const Letterbox box = fit({640, 480}, {640, 480});
  EXPECT_EQ(box.left_px, 0);
  EXPECT_EQ(box.top_px, 0);
  EXPECT_EQ(box.width_px, 640);
  EXPECT_EQ(box.height_px, 480);
  EXPECT_EQ(to_picture(box, 17, 300).x_px, 17);
  EXPECT_EQ(to_picture(box, 17, 300).y_px, 300);
}

TEST(Letterbox, WideWindowHasBarsAtTheSides) {
  const Letterbox box = fit({64, 48}, {400, 96});
  EXPECT_EQ(box.width_px, 128);
  EXPECT_EQ(box.height_px, 96);
  EXPECT_EQ(box.left_px, 136);
  EXPECT_EQ(box.top_px, 0);
  // Twice as large: window pixels 0 and 1 of the box lie at -0.25 and 0.25.
  EXPECT_FLOAT_EQ(to_picture(box, 136, 1).x_px, -0.25F);
  EXPECT_FLOAT_EQ(to_picture(box, 136, 1).y_px, 0.25F);
  EXPECT_LT(to_picture(box, 0, 0).x_px, -0.5F);
}

TEST(Letterbox, AnyPictureInAnyWindowIsWholeInTheMiddleAndTouchesTwoEdges) {
  constexpr unsigned kSeed = 7;
  std::mt19937 random(kSeed);
  std::uniform_int_distribution<int> size(1, 3000);
  for (int i = 0; i < 2000; ++i) {
    const DisplayFormat picture{size(random), size(random)}, window{size(random), size(random)};
    const Letterbox box = fit(picture, window);
    SCOPED_TRACE(testing::Message() << "seed " << kSeed << ": " << picture.width_px << "x"
                                    << picture.height_px << " in " << window.width_px << "x"
                                    << window.height_px);
    ASSERT_TRUE(box.width_px == window.width_px || box.height_px == window.height_px);
    ASSERT_LE(std::abs(window.width_px - box.width_px - 2 * box.left_px), 1);
    ASSERT_LE(std::abs(window.height_px - box.height_px - 2 * box.top_px), 1);
    ASSERT_GE(box.width_px, 1);
    ASSERT_GE(box.height_px, 1);
    const double scale =
        std::min(1.0 * window.width_px / picture.width_px, 1.0 * window.height_px / picture.height_px);
    ASSERT_NEAR(box.width_px, std::max(1.0, scale * picture.width_px), 0.51);
    ASSERT_NEAR(box.height_px, std::max(1.0, scale * picture.height_px), 0.51);
    // The corners of the box are the corners of the picture.
    const PicturePoint first = to_picture(box, box.left_px, box.top_px);
    const PicturePoint behind = to_picture(box, box.left_px + box.width_px, box.top_px + box.height_px);
    ASSERT_NEAR(first.x_px + 0.5F,
                0.5F * static_cast<float>(picture.width_px) / static_cast<float>(box.width_px), 1e-2F);
    ASSERT_NEAR(behind.x_px - first.x_px, picture.width_px, 1e-3F * static_cast<float>(picture.width_px));
    ASSERT_NEAR(behind.y_px - first.y_px, picture.height_px, 1e-3F * static_cast<float>(picture.height_px));
  }
}

}  // namespace
}  // namespace tactus::hal::egl
