#include "hal/v4l2/uvc_stamp.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <random>
#include <string>
#include <vector>

namespace tactus::hal::v4l2 {
namespace {

constexpr std::uint32_t kClockHz = 48'000'000;
using Bytes = std::vector<std::uint8_t>;

void add_little(Bytes& out, std::uint32_t value, int bytes) {
  for (int i = 0; i < bytes; ++i) out.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}

/// A block as uvcvideo writes it: the payload header with PTS and SCR, 12 bytes.
Bytes block(std::uint64_t host_ns, std::uint32_t pts, std::uint32_t scr, std::uint8_t flags = 0x8c) {
  Bytes out(10);
  std::memcpy(out.data(), &host_ns, 8);
  const std::uint16_t host_sof = 1234;
  std::memcpy(out.data() + 8, &host_sof, 2);
  out.push_back(12);
  out.push_back(flags);
  add_little(out, pts, 4);
  add_little(out, scr, 4);
  add_little(out, 0x0fff, 2);
  return out;
}

Bytes operator+(Bytes a, const Bytes& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

TEST(UvcStamp, BlockIsReadFieldByField) {
  const Bytes bytes = block(0x0102'0304'0506'0708, 0xdead'beef, 0x1234'5678);
  std::span<const std::uint8_t> rest(bytes);
  const auto stamp = take_uvc_stamp(rest);
  ASSERT_TRUE(stamp);
  EXPECT_TRUE(rest.empty());
  EXPECT_EQ(stamp->host_ns, 0x0102'0304'0506'0708U);
  EXPECT_EQ(stamp->host_sof, 1234);
  EXPECT_EQ(stamp->pts, 0xdead'beefU);
  EXPECT_EQ(stamp->scr, 0x1234'5678U);
  EXPECT_EQ(stamp->device_sof, 0x7ff) << "eleven bits";
  EXPECT_FALSE(stamp->is_error);
}

TEST(UvcStamp, HeaderWithoutStampsAndWithVendorsBytesIsPassedOver) {
  Bytes bytes(10);
  bytes.insert(bytes.end(), {2, 0x80});                // no stamps
  bytes.resize(bytes.size() + 10);
  bytes.insert(bytes.end(), {22, 0x84, 1, 0, 0, 0});   // PTS, then sixteen bytes that only the vendor knows
  bytes.resize(bytes.size() + 16);
  std::span<const std::uint8_t> rest(bytes);
  const auto bare = take_uvc_stamp(rest);
  ASSERT_TRUE(bare);
  EXPECT_FALSE(bare->pts || bare->scr);
  const auto vendor = take_uvc_stamp(rest);
  ASSERT_TRUE(vendor);
  EXPECT_EQ(vendor->pts, 1U);
  EXPECT_FALSE(vendor->scr);
  EXPECT_FALSE(take_uvc_stamp(rest));
}

TEST(UvcStamp, CutBlocksEndTheReadingWithoutReachingBeyond) {
  const Bytes whole = block(1, 2, 3);
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const Bytes cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size));
    std::span<const std::uint8_t> rest(cut);
    EXPECT_FALSE(take_uvc_stamp(rest)) << size;
    EXPECT_TRUE(rest.empty()) << size;
  }
}

TEST(UvcStamp, RandomBytesEndAndAreNeverReadTwice) {
  const std::uint64_t seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937_64 random(seed);
  for (int trial = 0; trial < 2000; ++trial) {
    Bytes bytes(random() % 200);
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random() % 32);
    std::span<const std::uint8_t> rest(bytes);
    std::size_t before = bytes.size() + 1;
    while (take_uvc_stamp(rest)) {
      ASSERT_LT(rest.size(), before);
      before = rest.size();
    }
    (void)capture_begin_ns(bytes, kClockHz);
    (void)uvc_clock_hz(bytes, 0);
  }
}

TEST(UvcCaptureBegin, IsTheEarliestOfTheFramesPayloads) {
  // Captured at 1 s; payloads leave 20 ms, 21 ms later and arrive after 3 ms and after 0.2 ms.
  const std::uint32_t pts = 0xffff'f000;  // the device's clock wraps meanwhile
  const Bytes bytes = block(1'023'000'000, pts, pts + kClockHz / 50) +
                      block(1'021'200'000, pts, pts + kClockHz / 50 + kClockHz / 1000);
  EXPECT_EQ(capture_begin_ns(bytes, kClockHz), 1'000'200'000);
}

TEST(UvcCaptureBegin, BlocksThatSayNothingUsefulAreLeftOut) {
  EXPECT_EQ(capture_begin_ns({}, kClockHz), std::nullopt);
  EXPECT_EQ(capture_begin_ns(block(1'000'000'000, 5, 10), 0), std::nullopt) << "no clock rate";
  EXPECT_EQ(capture_begin_ns(block(1'000'000'000, 5, 10, 0x8c | 0x40), kClockHz), std::nullopt) << "error flag";
  EXPECT_EQ(capture_begin_ns(block(1'000'000'000, 5, 10, 0x84), kClockHz), std::nullopt) << "no SCR";
  EXPECT_EQ(capture_begin_ns(block(1'000'000'000, 10, 5), kClockHz), std::nullopt) << "PTS after SCR";
  EXPECT_EQ(capture_begin_ns(block(~std::uint64_t{0}, 5, 10), kClockHz), std::nullopt) << "no time of this host";
}

TEST(CaptureClock, FramesWithoutMetadataKeepTheDistanceOfTheOneBefore) {
  CaptureClock sut;
  EXPECT_EQ(sut.at(1'000'000'000, std::nullopt), 1'000'000'000);
  EXPECT_EQ(sut.at(1'033'000'000, 1'020'000'000), 1'020'000'000);
  EXPECT_EQ(sut.at(1'066'000'000, std::nullopt), 1'053'000'000);
}

TEST(CaptureClock, ImplausibleDistancesAreNotBelieved) {
  CaptureClock sut;
  EXPECT_EQ(sut.at(10'000'000'000, 9'000'000'000), 10'000'000'000) << "a second old";
  EXPECT_EQ(sut.at(11'000'000'000, 11'500'000'000), 11'000'000'000) << "from the future";
  EXPECT_EQ(sut.at(12'000'000'000, 11'990'000'000), 11'990'000'000);
}

/// Device, configuration, and the two interfaces of a camera, the clock in the video control header.
Bytes camera_descriptors(std::uint8_t control_interface) {
  Bytes out{18, 1, 0, 2, 0xef, 2, 1, 64, 9, 0x12, 1, 0, 0, 1, 1, 2, 0, 1};
  out = out + Bytes{9, 2, 0, 0, 2, 1, 0, 0x80, 50};
  out = out + Bytes{8, 11, 0, 2, 14, 3, 0, 2};
  out = out + Bytes{9, 4, control_interface, 0, 0, 14, 1, 0, 2};
  out = out + Bytes{13, 0x24, 1, 0, 1, 40, 0};
  add_little(out, kClockHz, 4);
  out = out + Bytes{1, 1};
  return out + Bytes{9, 4, 1, 0, 1, 14, 2, 0, 0, 12, 0x24, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1};
}

TEST(UvcClock, RateIsThatOfTheControlInterface) {
  EXPECT_EQ(uvc_clock_hz(camera_descriptors(0), 0), kClockHz);
  EXPECT_EQ(uvc_clock_hz(camera_descriptors(3), 3), kClockHz);
  EXPECT_EQ(uvc_clock_hz(camera_descriptors(3), 0), 0U) << "another interface's";
  EXPECT_EQ(uvc_clock_hz({}, 0), 0U);
}

}  // namespace
}  // namespace tactus::hal::v4l2
