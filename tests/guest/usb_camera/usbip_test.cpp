#include "tests/guest/usb_camera/usbip.hpp"

#include <gtest/gtest.h>

namespace tactus::guest::usbip {
namespace {

// As the kernel's Documentation/usb/usbip_protocol.rst lays them out: big-endian words of 4 bytes.
Message words(std::array<std::uint32_t, 12> values) {
  Message message{};
  for (std::size_t i = 0; i < message.size(); ++i) message[i] = static_cast<std::uint8_t>(values[i / 4] >> (24 - i % 4 * 8));
  return message;
}

TEST(Usbip, SubmitFromTheProtocolsExampleIsUnderstood) {
  // The example of the protocol's description: read 64 bytes from endpoint 1, no setup.
  const auto parsed = parse(words({1, 0xd05, 0x1000f, 1, 1, 0x200, 0x40, 0xffffffff, 0, 4, 0, 0}));
  ASSERT_TRUE(parsed);
  const auto& submit = std::get<Submit>(*parsed);
  EXPECT_EQ(submit.number, 0xd05u);
  EXPECT_EQ(submit.endpoint, 1u);
  EXPECT_TRUE(submit.is_in);
  EXPECT_EQ(submit.data_bytes, 0x40u);
}

TEST(Usbip, SetupBytesKeepTheirOrder) {
  const auto parsed = parse(words({1, 7, 0x10001, 0, 0, 0, 26, 0, 0, 0, 0x21010002, 0x01001a00}));
  ASSERT_TRUE(parsed);
  const auto& submit = std::get<Submit>(*parsed);
  EXPECT_FALSE(submit.is_in);
  EXPECT_EQ(submit.setup, (std::array<std::uint8_t, 8>{0x21, 0x01, 0x00, 0x02, 0x01, 0x00, 0x1a, 0x00}));
}

TEST(Usbip, UnlinkNamesTheSubmitItTakesBack) {
  const auto parsed = parse(words({2, 9, 0x10001, 0, 0, 7, 0, 0, 0, 0, 0, 0}));
  ASSERT_TRUE(parsed);
  EXPECT_EQ(std::get<Unlink>(*parsed).number, 9u);
  EXPECT_EQ(std::get<Unlink>(*parsed).submit_number, 7u);
}

TEST(Usbip, WhatIsNeitherSubmitNorUnlinkIsNothing) {
  for (const std::uint32_t command : {0u, 3u, 4u, 0x01000000u}) EXPECT_FALSE(parse(words({command})));
}

TEST(Usbip, AnswersHaveNumberStatusAndLengthInTheirPlaces) {
  EXPECT_EQ(submit_answer(0xd05, 0, 0x40), words({3, 0xd05, 0, 0, 0, 0, 0x40}));
  EXPECT_EQ(submit_answer(6, kStalled, 0), words({3, 6, 0, 0, 0, 0xffffffe0}));
  EXPECT_EQ(unlink_answer(9, kUnlinked), words({4, 9, 0, 0, 0, 0xffffff98}));
}

}  // namespace
}  // namespace tactus::guest::usbip
