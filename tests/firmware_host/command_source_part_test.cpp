// Parts of sources: what is delivered, and what a recorder sees.
#include <gtest/gtest.h>

#include <vector>

#include "firmware_host/open_source.hpp"
#include "firmware_host/source_part.hpp"

namespace tactus::firmware {
namespace {

class Numbers final : public hal::FrameTap {
 public:
  std::vector<std::uint64_t> depth, color;
  void take(hal::Stream stream, const hal::RawFrame& frame) noexcept override {
    (stream == hal::Stream::depth ? depth : color).push_back(frame.header.sequence);
  }
};

using Sequence = std::vector<std::uint64_t>;

hal::Sensor room() { return std::move(*open_source("synthetic:wall?frames=9&mode=320x240")); }

/// Depth, then colour up to it, as a session reads them.
void read_all(hal::Sensor& sensor, Sequence& depth, Sequence& color) {
  std::vector<std::uint16_t> raw(320 * 240);
  std::vector<std::uint8_t> rgb(320 * 240 * 3);
  hal::FrameHeader header;
  while (sensor.depth->read(raw, header, {}) == rt::Status::ok) {
    depth.push_back(header.sequence);
    hal::FrameHeader next;
    while (sensor.color->peek(next, {}) == rt::Status::ok && next.time <= header.time) {
      color.push_back(next.sequence);
      if (next.sequence % 2 == 0)
        sensor.color->skip();
      else
        ASSERT_EQ(sensor.color->read(rgb, next, {}), rt::Status::ok);
    }
  }
  ASSERT_EQ(sensor.color->peek(header, {}), rt::Status::end_of_stream);
}

TEST(SourcePart, NumbersAreDeliveredAndShownAlone) {
  hal::Sensor sensor = room();
  play_numbers(sensor, {2, 6});
  Numbers seen;
  sensor.depth->set_tap(&seen);
  sensor.color->set_tap(&seen);
  Sequence depth, color;
  read_all(sensor, depth, color);
  EXPECT_EQ(depth, (Sequence{2, 3, 4, 5}));
  EXPECT_EQ(color, depth);
  EXPECT_EQ(seen.depth, depth);
  EXPECT_EQ(seen.color, depth);
  EXPECT_EQ(sensor.depth->counters().frames_delivered, 4u);
  EXPECT_EQ(sensor.color->counters().frames_delivered, 4u);
}

TEST(SourcePart, NextFramesOfADeviceCountFromWhereItIs) {
  hal::Sensor sensor = room();
  std::vector<std::uint16_t> raw(320 * 240);
  hal::FrameHeader header;
  ASSERT_EQ(sensor.depth->read(raw, header, {}), rt::Status::ok);
  play_next_frames(sensor, {2, 5});
  Numbers seen;
  sensor.depth->set_tap(&seen);
  sensor.color->set_tap(&seen);
  EXPECT_EQ(sensor.color->peek(header, {}), rt::Status::timeout) << "colour waits for depth to begin";
  Sequence depth, color;
  read_all(sensor, depth, color);
  EXPECT_EQ(depth, (Sequence{3, 4, 5}));
  EXPECT_EQ(color, depth);
  EXPECT_EQ(seen.depth, depth);
  EXPECT_EQ(seen.color, depth);
}

TEST(SourcePart, TakenBackTapSeesNothing) {
  hal::Sensor sensor = room();
  play_numbers(sensor, {0, 9});
  Numbers seen;
  sensor.depth->set_tap(&seen);
  sensor.depth->set_tap(nullptr);
  Sequence depth, color;
  read_all(sensor, depth, color);
  EXPECT_EQ(depth.size(), 9u);
  EXPECT_TRUE(seen.depth.empty());
}

}  // namespace
}  // namespace tactus::firmware
