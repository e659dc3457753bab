#include "hal/v4l2/modes.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "hal/v4l2/fourcc.hpp"
#include "tests/hal/v4l2/recorded_offers.hpp"

namespace tactus::hal::v4l2 {
namespace {

constexpr std::string_view kName = "/dev/video0 (camera)";

ModeChoice choose(const std::vector<FormatOffer>& offers, const ModeWish& wish) {
  const auto choice = choose_mode(offers, wish, kName);
  if (!choice) {
    ADD_FAILURE() << choice.error().message;
    return {};
  }
  return *choice;
}

std::string refusal(const std::vector<FormatOffer>& offers, const ModeWish& wish) {
  const auto choice = choose_mode(offers, wish, kName);
  return choice ? "was chosen" : choice.error().message;
}

void expect_choice(const ModeChoice& choice, std::uint32_t fourcc, int width, int height, double hz) {
  EXPECT_EQ(fourcc_text(choice.fourcc), fourcc_text(fourcc));
  EXPECT_EQ(choice.width, width);
  EXPECT_EQ(choice.height, height);
  EXPECT_NEAR(choice.interval.hz(), hz, 0.01);
}

TEST(V4l2Modes, DepthWithoutWishesIsVgaNear30HzInTheDeepestFormat) {
  expect_choice(choose(vivid_offers(), {Stream::depth, "", {}}), V4L2_PIX_FMT_Y16, 640, 480, 25);
  expect_choice(choose(depth_camera_offers(), {Stream::depth, "", {}}), V4L2_PIX_FMT_Z16, 640, 480, 30);
}

TEST(V4l2Modes, ColourWithoutWishesNeedsNoDecoder) {
  expect_choice(choose(webcam_offers(), {Stream::color, "", {}}), V4L2_PIX_FMT_YUYV, 640, 480, 30);
}

TEST(V4l2Modes, ColourOfASizeThatOnlyJpegBringsFastComesAsJpeg) {
  expect_choice(choose(webcam_offers(), {Stream::color, "", {1280, 720, 0}}), V4L2_PIX_FMT_MJPEG, 1280, 720, 30);
  expect_choice(choose(webcam_offers(), {Stream::color, "", {1280, 720, 10}}), V4L2_PIX_FMT_YUYV, 1280, 720, 10);
}

TEST(V4l2Modes, NamedFormatSizeAndRateAreTakenAsTheyAre) {
  expect_choice(choose(vivid_offers(), {Stream::depth, "y12", {320, 180, 60}}), V4L2_PIX_FMT_Y12, 320, 180, 60);
  expect_choice(choose(vivid_offers(), {Stream::color, "NV12", {0, 0, 40}}), V4L2_PIX_FMT_NV12, 640, 360, 40);
}

TEST(V4l2Modes, TelevisionRatesCountAsTheirRoundOnes) {
  const ModeChoice choice = choose(television_offers(), {Stream::color, "", {0, 0, 30}});
  expect_choice(choice, V4L2_PIX_FMT_YUYV, 720, 480, 29.97);
  EXPECT_EQ(choice.interval.numerator, 1001U);
  EXPECT_EQ(refusal(television_offers(), {Stream::color, "", {720, 0, 24}}),
            "/dev/video0 (camera) does not offer colour at 24 Hz; it has YUYV 720x480 at 29.97 Hz and YUYV 720x576 at 25 Hz");
}

TEST(V4l2Modes, RangesGiveTheWishWhenItIsOnTheirGrid) {
  expect_choice(choose(ranged_offers(), {Stream::color, "", {1280, 720, 24}}), V4L2_PIX_FMT_NV12, 1280, 720, 24);
  expect_choice(choose(ranged_offers(), {Stream::color, "", {}}), V4L2_PIX_FMT_NV12, 640, 480, 30);
  EXPECT_EQ(refusal(ranged_offers(), {Stream::color, "", {650, 480, 0}}),
            "/dev/video0 (camera) does not offer colour at 650x480; it has NV12 at 32..2592x32..1944");
  EXPECT_EQ(refusal(ranged_offers(), {Stream::color, "", {640, 480, 500}}),
            "/dev/video0 (camera) does not offer colour at 500 Hz; it has NV12 640x480 at 1..120 Hz");
}

TEST(V4l2Modes, ImpossibleSizeIsAnsweredWithTheSizes) {
  EXPECT_EQ(refusal(webcam_offers(), {Stream::color, "", {641, 480, 0}}),
            "/dev/video0 (camera) does not offer colour at 641x480; it has YUYV at 640x480 and 1280x720 and MJPG at "
            "640x480, 1280x720 and 1920x1080");
  EXPECT_EQ(refusal(depth_camera_offers(), {Stream::depth, "", {0, 481, 0}}),
            "/dev/video0 (camera) does not offer depth at a height of 481; it has Z16 at 1280x720, 848x480, 640x480, "
            "640x360 and 480x270");
}

TEST(V4l2Modes, ImpossibleRateIsAnsweredWithTheRates) {
  EXPECT_EQ(refusal(depth_camera_offers(), {Stream::depth, "Z16", {1280, 720, 60}}),
            "/dev/video0 (camera) does not offer depth at 60 Hz; it has Z16 1280x720 at 30, 15, 6 Hz");
}

TEST(V4l2Modes, MissingOrUnreadableFormatIsAnsweredWithTheFormats) {
  EXPECT_EQ(refusal(webcam_offers(), {Stream::depth, "", {}}),
            "/dev/video0 (camera) has no depth format that can be read (Z16, Y16 and Y12); it has YUYV and MJPG, so choose "
            "another device (tactus devices lists them)");
  EXPECT_EQ(refusal(webcam_offers(), {Stream::color, "NV12", {}}),
            "/dev/video0 (camera) does not offer NV12; as colour it has YUYV and MJPG");
  EXPECT_EQ(refusal(webcam_offers(), {Stream::depth, "Z16", {}}),
            "/dev/video0 (camera) does not offer Z16; of what can be read as depth it has nothing, only YUYV and MJPG");
  EXPECT_EQ(refusal(webcam_offers(), {Stream::depth, "YUYV", {}}),
            "the format YUYV cannot be read as depth; use Z16, Y16 and Y12, or leave it to the device");
  EXPECT_EQ(refusal({}, {Stream::color, "", {}}),
            "/dev/video0 (camera) has no colour format that can be read (YUYV, NV12, RGB3 and MJPG); it has no format at "
            "all, so choose another device (tactus devices lists them)");
}

TEST(V4l2Modes, DriverThatTellsNoRatesIsAskedForTheWish) {
  const std::vector<FormatOffer> offers{{V4L2_PIX_FMT_YUYV, {size(640, 480, {})}}};
  const ModeChoice wished = choose(offers, {Stream::color, "", {640, 480, 15}});
  EXPECT_NEAR(wished.interval.hz(), 15, 1e-9);
  EXPECT_EQ(choose(offers, {Stream::color, "", {}}).interval.denominator, 0U);
}

/// Whatever is offered and wished: a choice is offered and meets the wish, a refusal means that nothing does.
TEST(V4l2Modes, RandomWishesAreMetExactlyWhenSomethingMeetsThem) {
  const std::uint64_t seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937_64 random(seed);
  const auto pick = [&](const auto& values) { return values[random() % std::size(values)]; };
  constexpr int kWidths[] = {0, 320, 640, 1280}, kHeights[] = {0, 180, 360, 480};
  constexpr double kRates[] = {0, 5, 10, 15, 30, 60};
  constexpr std::uint32_t kFormats[] = {V4L2_PIX_FMT_Z16,  V4L2_PIX_FMT_Y16,   V4L2_PIX_FMT_Y12, V4L2_PIX_FMT_YUYV,
                                        V4L2_PIX_FMT_NV12, V4L2_PIX_FMT_MJPEG, V4L2_PIX_FMT_GREY};
  int chosen_count = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    std::vector<FormatOffer> offers;
    for (std::uint64_t f = random() % 4; f > 0; --f) {
      FormatOffer offer{pick(kFormats), {}};
      for (std::uint64_t s = random() % 3 + 1; s > 0; --s)
        offer.sizes.push_back(size(pick(std::span(kWidths).subspan(1)), pick(std::span(kHeights).subspan(1)),
                                   {{1, static_cast<std::uint32_t>(pick(std::span(kRates).subspan(1)))}}));
      offers.push_back(offer);
    }
    const Stream stream = random() % 2 == 0 ? Stream::depth : Stream::color;
    const ModeWish wish{stream, "", {pick(kWidths), pick(kHeights), pick(kRates)}};
    const auto meets = [&](const FormatOffer& offer, const SizeOffer& s) {
      bool is_readable = false;
      for (const ReadableFormat& r : readable_formats(stream)) is_readable |= r.fourcc == offer.fourcc;
      return is_readable && (wish.mode.width == 0 || s.width.min == wish.mode.width) &&
             (wish.mode.height == 0 || s.height.min == wish.mode.height) &&
             (wish.mode.frame_rate_hz == 0 || std::fabs(s.intervals[0].hz() - wish.mode.frame_rate_hz) < 1e-9);
    };
    bool is_possible = false;
    for (const FormatOffer& offer : offers)
      for (const SizeOffer& s : offer.sizes) is_possible |= meets(offer, s);
    const auto choice = choose_mode(offers, wish, kName);
    ASSERT_EQ(choice.has_value(), is_possible) << "trial " << trial;
    if (!choice) continue;
    ++chosen_count;
    bool is_offered = false;
    for (const FormatOffer& offer : offers)
      for (const SizeOffer& s : offer.sizes)
        is_offered |= offer.fourcc == choice->fourcc && s.width.min == choice->width && s.height.min == choice->height &&
                      s.intervals[0].denominator == choice->interval.denominator && meets(offer, s);
    ASSERT_TRUE(is_offered) << "trial " << trial;
  }
  EXPECT_GT(chosen_count, 100);
}

TEST(V4l2Modes, LinesForPeopleNameRatesAndWhatIsNotReadable) {
  const auto lines = mode_lines(webcam_offers());
  ASSERT_EQ(lines.size(), 5U);
  EXPECT_EQ(lines[0], "colour YUYV 640x480 30, 15 Hz");
  EXPECT_EQ(lines[4], "colour MJPG 1920x1080 30 Hz");
  const auto vivid = mode_lines(vivid_offers());
  EXPECT_EQ(vivid.back(), "not readable: UYVY and GREY");
  EXPECT_EQ(mode_lines(ranged_offers()).front(), "colour NV12 32..2592x32..1944 1..120 Hz");
}

TEST(V4l2Modes, NearestOnAGridStaysOnIt) {
  const Extent grid{32, 100, 16};
  EXPECT_EQ(grid.nearest(0), 32);
  EXPECT_EQ(grid.nearest(55), 48);
  EXPECT_EQ(grid.nearest(1000), 96) << "100 is not on the grid";
}

TEST(V4l2Fourcc, TextAndCodeAreInverse) {
  for (const std::uint32_t fourcc : {V4L2_PIX_FMT_Z16, V4L2_PIX_FMT_Y12, V4L2_PIX_FMT_MJPEG, V4L2_PIX_FMT_Y16_BE})
    EXPECT_EQ(parse_fourcc(fourcc_text(fourcc)), fourcc) << fourcc_text(fourcc);
  EXPECT_EQ(fourcc_text(V4L2_PIX_FMT_Z16), "Z16");
  EXPECT_EQ(fourcc_text(V4L2_PIX_FMT_Y16_BE), "Y16-BE");
  EXPECT_EQ(parse_fourcc("mjpeg"), V4L2_PIX_FMT_MJPEG);
  EXPECT_EQ(parse_fourcc("yuyv"), V4L2_PIX_FMT_YUYV);
  EXPECT_EQ(parse_fourcc(""), std::nullopt);
  EXPECT_EQ(parse_fourcc("YUYV2"), std::nullopt);
  EXPECT_EQ(parse_fourcc("\x01"), std::nullopt);
  EXPECT_EQ(fourcc_text(0x01020304), "????");
}

}  // namespace
}  // namespace tactus::hal::v4l2
