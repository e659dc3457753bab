#include "tests/bench/depth_codec_peers.hpp"

#include <gtest/gtest.h>

#include "tests/hal/record/depth_pictures.hpp"

namespace tactus::bench {
namespace {

TEST(DepthCodecPeers, EveryKindOfImageComesBack) {
  constexpr int kWidth = 37, kHeight = 23;
  for (int kind = 0; kind < hal::record::kDepthKinds; ++kind) {
    const auto depth = hal::record::depth_picture(static_cast<hal::record::DepthKind>(kind), kWidth, kHeight, 9);
    std::vector<std::uint8_t> bytes;
    std::vector<std::uint16_t> back(depth.size(), 3);
    rvl_encode(depth, bytes);
    ASSERT_TRUE(rvl_decode(bytes, back)) << kind;
    EXPECT_EQ(back, depth) << kind;
    median_planes(depth, kWidth, bytes);
    from_median_planes(bytes, kWidth, back);
    EXPECT_EQ(back, depth) << kind;
  }
}

/// 100 pixels of the same value after 20 holes: three counts, one difference, 99 zeros, each of one nibble or more.
TEST(DepthCodecPeers, RvlIsAsSmallAsThePaperHasIt) {
  std::vector<std::uint16_t> depth(120, 1000);
  std::fill_n(depth.begin(), 20, std::uint16_t{0});
  std::vector<std::uint8_t> bytes;
  rvl_encode(depth, bytes);
  // 20: 2 nibbles; 100: 3; +1000 as 2000: 4; 99 zeros; in words of 8 nibbles.
  EXPECT_EQ(bytes.size(), (2 + 3 + 4 + 99 + 7) / 8 * 4U);
}

}  // namespace
}  // namespace tactus::bench
