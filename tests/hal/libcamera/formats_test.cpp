#include "hal/libcamera/present/formats.hpp"

#include <gtest/gtest.h>

#include <map>

namespace tactus::hal::libcamera {
namespace {

lc::PixelFormat named(const char* name) { return lc::PixelFormat::fromString(name); }

lc::StreamFormats webcam() {
  return lc::StreamFormats(std::map<lc::PixelFormat, std::vector<lc::SizeRange>>{
      {named("YUYV"), {lc::Size(320, 240), lc::Size(640, 480)}},
      {named("MJPEG"), {lc::Size(640, 480), lc::Size(1280, 720), lc::Size(1920, 1080)}},
      {named("R8"), {lc::Size(640, 480)}}});
}

lc::StreamFormats image_processor() {
  return lc::StreamFormats(std::map<lc::PixelFormat, std::vector<lc::SizeRange>>{
      {named("BGR888"), {lc::SizeRange({64, 64}, {4096, 2160}, 2, 2)}},
      {named("NV12"), {lc::SizeRange({64, 64}, {4096, 2160}, 1, 1)}}});
}

TEST(LibcameraFormats, NothingAskedGivesVgaInTheCheapestFormat) {
  const auto choice = choose_format(webcam(), {}, "");
  ASSERT_TRUE(choice) << choice.error().message;
  EXPECT_EQ(choice->ours, PixelFormat::yuyv);
  EXPECT_EQ(choice->theirs, named("YUYV"));
  EXPECT_EQ(choice->size, lc::Size(640, 480));
}

TEST(LibcameraFormats, SizeThatOnlyOneFormatHasDecidesForIt) {
  const auto choice = choose_format(webcam(), {.width = 1280, .height = 720}, "");
  ASSERT_TRUE(choice) << choice.error().message;
  EXPECT_EQ(choice->ours, PixelFormat::mjpeg);
  EXPECT_EQ(choice->size, lc::Size(1280, 720));
}

TEST(LibcameraFormats, FormatAskedForIsTaken) {
  const auto choice = choose_format(webcam(), {.width = 640, .height = 480}, "MJPEG");
  ASSERT_TRUE(choice) << choice.error().message;
  EXPECT_EQ(choice->ours, PixelFormat::mjpeg);
}

TEST(LibcameraFormats, RangeOfSizesHoldsThoseOnItsSteps) {
  const auto choice = choose_format(image_processor(), {.width = 642, .height = 482}, "");
  ASSERT_TRUE(choice) << choice.error().message;
  EXPECT_EQ(choice->ours, PixelFormat::rgb24);
  EXPECT_EQ(choice->size, lc::Size(642, 482));
  EXPECT_FALSE(choose_format(image_processor(), {.width = 641, .height = 481}, "BGR888")) << "not on the steps";
  EXPECT_FALSE(choose_format(image_processor(), {.width = 641, .height = 481}, "NV12")) << "half a pair of pixels";
  EXPECT_FALSE(choose_format(image_processor(), {.width = 8192, .height = 4320}, ""));
}

TEST(LibcameraFormats, WithoutVgaTheLargestWithin720pElseTheSmallestIsChosen) {
  const auto only = [](std::vector<lc::SizeRange> sizes) {
    return lc::StreamFormats(std::map<lc::PixelFormat, std::vector<lc::SizeRange>>{{named("YUYV"), std::move(sizes)}});
  };
  const auto within = choose_format(only({lc::Size(320, 240), lc::Size(960, 540), lc::Size(1920, 1080)}), {}, "");
  ASSERT_TRUE(within) << within.error().message;
  EXPECT_EQ(within->size, lc::Size(960, 540));
  const auto above = choose_format(only({lc::Size(3840, 2160), lc::Size(1920, 1080)}), {}, "");
  ASSERT_TRUE(above) << above.error().message;
  EXPECT_EQ(above->size, lc::Size(1920, 1080));
}

TEST(LibcameraFormats, RefusalListsWhatThereIs) {
  const auto refused = choose_format(webcam(), {.width = 800, .height = 600}, "YUYV");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, rt::ExitCode::bad_usage);
  EXPECT_NE(refused.error().message.find("YUYV of 800x600"), std::string::npos) << refused.error().message;
  EXPECT_NE(refused.error().message.find("color YUYV 320x240"), std::string::npos) << refused.error().message;
  EXPECT_NE(refused.error().message.find("color MJPEG 1920x1080"), std::string::npos) << refused.error().message;
}

TEST(LibcameraFormats, Rgb888IsRefusedBecauseItsBytesAreTheOtherWayRound) {
  EXPECT_EQ(raw_format(named("BGR888")), PixelFormat::rgb24);
  EXPECT_FALSE(raw_format(named("RGB888")));
  const auto refused = choose_format(image_processor(), {}, "RGB888");
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("ask for BGR888"), std::string::npos) << refused.error().message;
}

TEST(LibcameraFormats, FormatThatCannotBeTakenIsListedAsSuch) {
  const auto lines = describe(webcam());
  EXPECT_EQ(lines.size(), 6U);
  EXPECT_EQ(std::count(lines.begin(), lines.end(), "R8 (cannot be taken)"), 1);
}

}  // namespace
}  // namespace tactus::hal::libcamera
