// Small enough for an emulator: decoding and the numbers in text are the same on every machine.
#include <gtest/gtest.h>

#include "hal/replay/recording_writer.hpp"
#include "hal/replay/text.hpp"
#include "tests/hal/replay/recording_folder.hpp"

namespace tactus::hal::replay {
namespace {

std::uint64_t fnv1a(std::span<const std::uint8_t> bytes) {
  std::uint64_t hash = 14695981039346656037U;
  for (const std::uint8_t byte : bytes) hash = (hash ^ byte) * 1099511628211U;
  return hash;
}

TEST(ReplaySmoke, RecordingRoundTrips) {
  const RecordingFolder source(2);
  const test::TemporaryFolder target;
  auto from = open_replay(source.path(), {});
  ASSERT_TRUE(from.has_value());
  ASSERT_TRUE(write_recording(target.path() / "copy", *from, {.color = ColorEncoding::png}));
  auto sut = open_replay(target.path() / "copy", {.prefetch = 2});
  ASSERT_TRUE(sut.has_value());
  const Played depth = play_depth(*sut);
  ASSERT_EQ(depth.depth.size(), 2U);
  EXPECT_EQ(depth.depth[1], depth_image(1));
  EXPECT_EQ(play_color(*sut).color.at(0), bytes_image(kPixels * 3, 1000));
}

TEST(ReplaySmoke, JpegPixelsAreTheSameBitsEverywhere) {
  const test::TemporaryFolder folder;
  std::vector<std::uint8_t> rgb(kPixels * 3);
  for (std::size_t i = 0; i < rgb.size(); ++i) rgb[i] = static_cast<std::uint8_t>(i * 7 / 5 + i / 120 * 3);
  ASSERT_TRUE(write_color_jpeg(folder.path() / "c.jpg", rgb, kWidth, kHeight, 90));
  std::vector<std::uint8_t> out(rgb.size());
  ASSERT_EQ(decode_color(folder.read("c.jpg"), kWidth, kHeight, out), "");
  EXPECT_EQ(fnv1a(out), 3861305422495588049U);
}

TEST(ReplaySmoke, TimesAreExact) { EXPECT_EQ(parse_seconds_as_ns("1305031229.528784"), 1305031229528784000); }

}  // namespace
}  // namespace tactus::hal::replay
