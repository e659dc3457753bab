#include "tests/guest/usb_camera/payload.hpp"

#include <gtest/gtest.h>

#include <numeric>
#include <random>

namespace tactus::guest {
namespace {

TEST(PayloadHeader, BitsAndTimesAreWhereUvcPutsThem) {
  const auto bytes = to_bytes({true, true, false, 0x12345678, 0x9abcdef0, 0x7ff});
  EXPECT_EQ(bytes, (std::array<std::uint8_t, 12>{12, 0x8f, 0x78, 0x56, 0x34, 0x12, 0xf0, 0xde, 0xbc, 0x9a, 0xff, 0x07}));
  EXPECT_EQ(to_bytes({})[1], 0x8c);
  EXPECT_EQ(to_bytes({false, false, true, 0, 0, 0})[1], 0xcc);
}

TEST(PayloadHeader, BusFrameKeepsItsElevenBits) {
  const auto bytes = to_bytes({false, false, false, 0, 0, 0xffff});
  EXPECT_EQ(bytes[10], 0xff);
  EXPECT_EQ(bytes[11], 0x07);
}

TEST(FrameCutter, PayloadsOfAnySizePutTogetherAreTheFrame) {
  const unsigned seed = 5;
  std::mt19937 random(seed);
  FrameCutter cutter;
  bool last_id = false;
  for (int i = 0; i < 200; ++i) {
    SCOPED_TRACE("seed " + std::to_string(seed) + ", frame " + std::to_string(i));
    std::vector<std::uint8_t> frame(1 + random() % 3000);
    std::iota(frame.begin(), frame.end(), std::uint8_t{0});
    cutter.begin({frame, 77, i % 3 == 0});
    std::vector<std::uint8_t> together;
    bool frame_id = false;
    for (bool is_first = true; cutter.is_sending(); is_first = false) {
      const std::size_t most = 13 + random() % 700;
      const auto payload = cutter.next(most, 1, 2);
      ASSERT_LE(payload.size(), most);
      ASSERT_GT(payload.size(), 12u);
      ASSERT_EQ(payload[0], 12);
      if (is_first) frame_id = (payload[1] & 1) != 0;
      EXPECT_EQ((payload[1] & 1) != 0, frame_id) << "one number in all of a frame";
      EXPECT_EQ((payload[1] & 2) != 0, !cutter.is_sending()) << "the end is in the last alone";
      EXPECT_EQ((payload[1] & 64) != 0, !cutter.is_sending() && i % 3 == 0);
      EXPECT_EQ(payload[2], 77);
      together.insert(together.end(), payload.begin() + 12, payload.end());
    }
    EXPECT_EQ(together, frame);
    EXPECT_NE(frame_id, last_id) << "the next frame has the other number";
    last_id = frame_id;
  }
}

}  // namespace
}  // namespace tactus::guest
