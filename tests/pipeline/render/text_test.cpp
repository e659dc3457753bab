// Text and the crosshair, pixel by pixel.
#include "pipeline/render/text.hpp"

#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include "pipeline/render/font.hpp"
#include "tests/pipeline/render/drawing.hpp"
#include "tests/pipeline/render/golden.hpp"
#include "tests/pipeline/render/picture.hpp"

namespace tactus::render {
namespace {

constexpr int kWidth = 320, kHeight = 120;
constexpr Rgb8 kGround{200, 100, 50};

class TextTest : public test::DrawingTest {
 protected:
  void SetUp() override {
    RenderConfig config;
    config.camera = test::pinhole(kWidth, kHeight, 280);
    config.bodies_count_max = 1;
    open(config);
    for (int i = 0; i < kWidth * kHeight; ++i) video_.insert(video_.end(), {kGround.r, kGround.g, kGround.b});
    inputs_.video_rgb = video_;
    inputs_.is_tracked = false;
  }

  test::Picture picture() {
    test::Picture drawn(kWidth, kHeight);
    EXPECT_EQ(draw(inputs_, drawn.rgb), rt::Status::ok);
    return drawn;
  }

  std::vector<std::uint8_t> video_;
  RenderInputs inputs_;
};

TEST_F(TextTest, EveryPixelOfALineIsInkOrDarkenedGroundOrUntouched) {
  const std::string text = "Grab: q, (jump)";
  constexpr Rgb8 kInk{250, 240, 30};
  for (const int scale : {1, 3}) {
    const std::array<TextLine, 1> lines = {TextLine{text, 7, 11, kInk, scale}};
    inputs_.text = lines;
    const test::Picture drawn = picture();
    int ink_count = 0;
    for (int v = 0; v < kHeight; ++v)
      for (int u = 0; u < kWidth; ++u) {
        const int column = u < 7 ? -1 : (u - 7) / (kGlyphWidth * scale), y = v < 11 ? -1 : (v - 11) / scale;
        if (column < 0 || column >= static_cast<int>(text.size()) || y < 0 || y >= kGlyphHeight) {
          ASSERT_EQ(drawn.at(u, v), kGround) << u << ' ' << v;
          continue;
        }
        const int x = (u - 7) / scale - column * kGlyphWidth;
        const bool is_ink = glyph_ink(text[static_cast<std::size_t>(column)], x, y);
        ink_count += is_ink ? 1 : 0;
        ASSERT_EQ(drawn.at(u, v), (is_ink ? kInk : Rgb8{90, 45, 23})) << u << ' ' << v;
      }
    EXPECT_GT(ink_count, 100);
  }
}

TEST_F(TextTest, CrosshairLiesAboutTheMiddleAndLeavesItFree) {
  inputs_.crosshair = Crosshair{kWidth / 2, kHeight / 2, {0, 255, 0}};
  const test::Picture drawn = picture();
  int green_count = 0, sum_u = 0, sum_v = 0;
  for (int v = 0; v < kHeight; ++v)
    for (int u = 0; u < kWidth; ++u)
      if (drawn.at(u, v) == Rgb8{0, 255, 0}) {
        ++green_count;
        sum_u += u;
        sum_v += v;
      }
  EXPECT_EQ(green_count, 4 * 2 * 8);
  EXPECT_EQ(2 * sum_u, green_count * (kWidth - 1));
  EXPECT_EQ(2 * sum_v, green_count * (kHeight - 1));
  EXPECT_EQ(drawn.at(kWidth / 2, kHeight / 2), kGround);
}

TEST_F(TextTest, AllGlyphsLookLikeTheirGoldenPicture) {
  std::array<std::string, 3> rows;
  for (int i = 0; i < kGlyphsCount; ++i)
    rows[static_cast<std::size_t>(i / 32)] += static_cast<char>(kGlyphFirst + i);
  const std::array<TextLine, 4> lines = {TextLine{rows[0], 8, 8, {255, 255, 255}, 1},
                                         TextLine{rows[1], 8, 20, {255, 255, 255}, 1},
                                         TextLine{rows[2], 8, 32, {255, 255, 255}, 1},
                                         TextLine{"Squeeze: throw a ball", 8, 60, {255, 220, 80}, 2}};
  inputs_.text = lines;
  inputs_.crosshair = Crosshair{kWidth / 2, kHeight / 2, {120, 255, 120}};
  test::expect_golden(picture(), "text");
}

TEST(Font, GlyphsAreAllDifferentAndKeepTheirRightColumnAndLastRowClear) {
  std::set<std::string> seen;
  for (char c = kGlyphFirst; c <= kGlyphLast; ++c) {
    std::string ink;
    for (int y = 0; y < kGlyphHeight; ++y)
      for (int x = 0; x < kGlyphWidth; ++x) ink += glyph_ink(c, x, y) ? '#' : '.';
    EXPECT_TRUE(seen.insert(ink).second) << c;
    for (int y = 0; y < kGlyphHeight; ++y) EXPECT_FALSE(glyph_ink(c, kGlyphWidth - 1, y)) << c;
    EXPECT_EQ(c == ' ', ink.find('#') == std::string::npos) << c;
  }
}

TEST(BuildText, MoreThanFitsIsCutAndNothingOverflows) {
  const std::string text(200, 'x');
  constexpr int kFar = std::numeric_limits<int>::max();
  std::vector<TextLine> lines(50, TextLine{text, 0, 0, {}, 1});
  std::vector<GlyphInstance> instances(kGlyphInstancesMax);
  EXPECT_EQ(build_text(lines, Crosshair{320, 240, {1, 2, 3}}, 640, 480, instances), kGlyphInstancesMax);
  const std::array<TextLine, 5> outside = {TextLine{text, kFar, 0, {}, 1}, TextLine{text, -kFar, 0, {}, 1},
                                           TextLine{text, 0, kFar, {}, 1}, TextLine{text, 0, -kFar, {}, 99},
                                           TextLine{text, 0, 480, {}, 1}};
  EXPECT_EQ(build_text(outside, std::nullopt, 640, 480, instances), 0U);
  const std::array<TextLine, 1> foreign = {TextLine{"\xc3\xa4", 0, 0, {}, 1}};
  ASSERT_EQ(build_text(foreign, std::nullopt, 640, 480, instances), 2U);
  EXPECT_EQ(instances[0].color_glyph[3], '?' - ' ');
}

}  // namespace
}  // namespace tactus::render
