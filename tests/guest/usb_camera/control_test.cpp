#include "tests/guest/usb_camera/control.hpp"

#include <gtest/gtest.h>

namespace tactus::guest {
namespace {

const CameraSpec kCamera{"a camera", "1",
                         {{hal::PixelFormat::depth16, 320, 240}, {hal::PixelFormat::yuyv, 320, 240}},
                         {333'333, 2'000'000}};

using SetupBytes = std::array<std::uint8_t, 8>;
constexpr SetupBytes kSetProbe1{0x21, 0x01, 0, 1, 1, 0, 26, 0}, kGetProbe1{0xa1, 0x81, 0, 1, 1, 0, 26, 0};
constexpr SetupBytes kSetCommit2{0x21, 0x01, 0, 2, 2, 0, 26, 0};

Bytes block_asking_for(std::uint32_t interval) {
  Bytes block(26);
  for (std::size_t i = 0; i < 4; ++i) block[4 + i] = static_cast<std::uint8_t>(interval >> 8 * i);
  return block;
}
std::uint32_t u32(const Bytes& bytes, std::size_t at) {
  return static_cast<std::uint32_t>(bytes[at] | bytes[at + 1] << 8 | bytes[at + 2] << 16) |
         static_cast<std::uint32_t>(bytes[at + 3]) << 24;
}

TEST(Control, ProbeAnswersTheNearestIntervalOnOffer) {
  Control control(kCamera);
  for (const auto& [asked, given] : {std::pair{0u, 333'333u}, {100u, 333'333u}, {1'000'000u, 333'333u},
                                     {1'900'000u, 2'000'000u}, {4'000'000'000u, 2'000'000u}}) {
    ASSERT_TRUE(control.answer(kSetProbe1, block_asking_for(asked)));
    const auto block = control.answer(kGetProbe1, {});
    ASSERT_TRUE(block);
    ASSERT_EQ(block->size(), 26u);
    EXPECT_EQ(u32(*block, 4), given) << asked;
    EXPECT_EQ(u32(*block, 18), 320u * 240 * 2);
    EXPECT_EQ(u32(*block, 22), kPayloadBytes);
  }
  EXPECT_FALSE(control.take_committed()) << "a probe starts nothing";
}

TEST(Control, CommitStartsItsStreamAndClearingTheEndpointStopsIt) {
  Control control(kCamera);
  ASSERT_TRUE(control.answer(kSetCommit2, block_asking_for(2'000'000)));
  EXPECT_EQ(control.take_committed(), 1u);
  EXPECT_FALSE(control.take_committed());
  EXPECT_EQ(control.frame_interval(1), 2'000'000u);
  EXPECT_EQ(control.frame_interval(0), 333'333u);
  EXPECT_FALSE(control.take_stopped());
  ASSERT_TRUE(control.answer(SetupBytes{0x02, 1, 0, 0, 0x82, 0, 0, 0}, {}));
  EXPECT_EQ(control.take_stopped(), 1u);
}

TEST(Control, BrightnessOfColourIsKeptWithinItsRange) {
  Control control(kCamera);
  constexpr SetupBytes kSet{0x21, 0x01, 0, 2, 0, 5, 2, 0}, kGet{0xa1, 0x81, 0, 2, 0, 5, 2, 0};
  EXPECT_EQ(control.answer(kGet, {}), (Bytes{0, 0}));
  ASSERT_TRUE(control.answer(kSet, Bytes{0xc0, 0xff}));
  EXPECT_EQ(control.answer(kGet, {}), (Bytes{0xc0, 0xff}));
  EXPECT_FALSE(control.answer(kSet, Bytes{0xbf, 0xff})) << "-65";
  EXPECT_EQ(control.answer(SetupBytes{0xa1, 0x82, 0, 2, 0, 5, 2, 0}, {}), (Bytes{0xc0, 0xff})) << "least";
  EXPECT_FALSE(control.answer(SetupBytes{0xa1, 0x81, 0, 2, 0, 2, 2, 0}, {})) << "depth has none";
}

TEST(Control, AnswersAreCutToWhatTheHostHasRoomFor) {
  Control control(kCamera);
  const auto head = control.answer(SetupBytes{0x80, 6, 0, 2, 0, 0, 9, 0}, {});
  ASSERT_TRUE(head);
  EXPECT_EQ(head->size(), 9u);
  const auto whole = control.answer(SetupBytes{0x80, 6, 0, 2, 0, 0, 0xff, 0x7f}, {});
  ASSERT_TRUE(whole);
  EXPECT_EQ(*whole, configuration_descriptor(kCamera));
}

TEST(Control, WhatItDoesNotKnowStalls) {
  Control control(kCamera);
  EXPECT_FALSE(control.answer(SetupBytes{0x80, 6, 0, 6, 0, 0, 10, 0}, {})) << "device qualifier";
  EXPECT_FALSE(control.answer(SetupBytes{0xa1, 0x81, 0, 3, 1, 0, 26, 0}, {})) << "a still image";
  EXPECT_FALSE(control.answer(SetupBytes{0xa1, 0x81, 0, 1, 3, 0, 26, 0}, {})) << "a third stream";
  EXPECT_FALSE(control.answer(SetupBytes{0xa1, 0x81, 0, 1, 1, 2, 26, 0}, {})) << "a control of a terminal";
  EXPECT_FALSE(control.answer(kSetProbe1, Bytes(10))) << "a block cut short";
}

}  // namespace
}  // namespace tactus::guest
