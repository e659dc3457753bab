#include "tests/guest/usb_camera/clip.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <string>
#include <vector>

#include "hal/synthetic/synthetic.hpp"
#include "tests/guest/usb_camera/yuyv.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tactus::guest {
namespace {

TEST(Clip, RenderedWrittenAndReadBackHoldsTheSensorsFrames) {
  const auto options = hal::parse_synthetic_name("synthetic:wall?mode=320x240&frames=2");
  ASSERT_TRUE(options);
  auto sensor = hal::open_synthetic(*options);
  ASSERT_TRUE(sensor);
  const auto rendered = Clip::render(*sensor);
  ASSERT_TRUE(rendered);
  const test::TemporaryFolder folder;
  ASSERT_TRUE(rendered->write(folder.path() / "clip"));
  const auto clip = Clip::read(folder.path() / "clip");
  ASSERT_TRUE(clip) << clip.error().message;
  ASSERT_EQ(clip->frames_count(), 2u);
  EXPECT_EQ(clip->width(), 320);
  EXPECT_EQ(clip->height(), 240);

  auto again = hal::open_synthetic(*options);
  std::vector<std::uint16_t> depth(320 * 240);
  std::vector<std::uint8_t> rgb(320 * 240 * 3), yuyv(320 * 240 * 2);
  hal::FrameHeader header;
  for (std::size_t i = 0; i < 2; ++i) {
    ASSERT_EQ(again->depth->read(depth, header, {}), rt::Status::ok);
    ASSERT_EQ(again->color->read(rgb, header, {}), rt::Status::ok);
    to_yuyv(rgb, yuyv);
    const auto depth_bytes = clip->frame(hal::PixelFormat::depth16, i);
    EXPECT_EQ(std::memcmp(depth_bytes.data(), depth.data(), depth_bytes.size()), 0);
    const auto color_bytes = clip->frame(hal::PixelFormat::yuyv, i);
    EXPECT_TRUE(std::equal(color_bytes.begin(), color_bytes.end(), yuyv.begin(), yuyv.end()));
  }
}

TEST(Clip, FilesThatAreNoWholeClipAreRefusedByName) {
  const test::TemporaryFolder folder;
  Clip clip(4, 2);
  clip.append(std::vector<std::uint8_t>(16), std::vector<std::uint8_t>(16));
  ASSERT_TRUE(clip.write(folder.path() / "whole"));
  const std::string whole = folder.read("whole");
  for (const std::string& bytes : {std::string(), whole.substr(0, 10), whole.substr(0, 16), whole.substr(0, whole.size() - 1),
                                   "x" + whole.substr(1)}) {
    const auto file = folder.write("broken", bytes);
    const auto read = Clip::read(file);
    ASSERT_FALSE(read);
    EXPECT_NE(read.error().message.find(file.string()), std::string::npos) << read.error().message;
  }
  EXPECT_FALSE(Clip::read(folder.path() / "absent"));
}

}  // namespace
}  // namespace tactus::guest
