// The conformance suite's rules for a camera that has no end and no second session alike: what the suite finds by playing
// twice is found here by looking at each frame as it comes. For OpenNI2, V4L2 and libcamera, on whatever drives them.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <optional>
#include <type_traits>
#include <vector>

#include "hal/camera.hpp"

namespace tactus::hal::conformance {

/// Counts what a recorder is shown.
class LiveWitness final : public FrameTap {
 public:
  void take(Stream, const RawFrame& frame) noexcept override {
    ++frames_count;
    last_sequence = frame.header.sequence;
    if (frame.bytes.empty() || frame.width < 1 || frame.height < 1) ++unusable_count;
  }
  std::uint64_t frames_count = 0, last_sequence = 0;
  int unusable_count = 0;
};

/// Takes `frames_count` frames and holds them to the rules: times and numbers rise, gaps are counted, frames have arrived,
/// 65535 is no depth, a colour frame that was announced is the one that is read or skipped, a tap sees each good frame once.
template <typename CameraKind>
void expect_live_rules(CameraKind& camera, int width, int height, int frames_count) {
  constexpr bool kIsDepth = std::is_same_v<CameraKind, DepthCamera>;
  using Pixel = std::conditional_t<kIsDepth, std::uint16_t, std::uint8_t>;
  constexpr rt::Duration kPatience{10'000'000'000};
  std::vector<Pixel> pixels(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * (kIsDepth ? 1 : 3));
  LiveWitness witness;
  camera.set_tap(&witness);
  const CameraCounters before = camera.counters();
  std::optional<FrameHeader> last;
  std::uint64_t gaps = 0;
  int taken_count = 0;
  for (int tries = 0; taken_count < frames_count && tries < 4 * frames_count; ++tries) {
    FrameHeader header, announced;
    bool is_skipped = false;
    if constexpr (!kIsDepth) {
      const rt::Status looked = camera.peek(announced, kPatience);
      if (looked == rt::Status::corrupt) continue;
      ASSERT_EQ(looked, rt::Status::ok);
      is_skipped = tries % 3 == 2;
      if (is_skipped) camera.skip();
      header = announced;
    }
    if (!is_skipped) {
      const rt::Status read = camera.read(pixels, header, kPatience);
      if (read == rt::Status::corrupt) continue;
      ASSERT_EQ(read, rt::Status::ok);
      if constexpr (!kIsDepth) {
        EXPECT_EQ(header.sequence, announced.sequence) << "what was announced is read";
      }
    }
    ++taken_count;
    EXPECT_NE(header.arrived.ns, 0) << "frame " << header.sequence;
    EXPECT_EQ(witness.frames_count, static_cast<std::uint64_t>(taken_count)) << "each good frame once";
    EXPECT_EQ(witness.last_sequence, header.sequence);
    if (last) {
      ASSERT_GT(header.sequence, last->sequence);
      EXPECT_GT(header.time.ns, last->time.ns) << "frame " << header.sequence;
      gaps += header.sequence - last->sequence - 1;
    }
    last = header;
    if constexpr (kIsDepth) {
      for (const Pixel value : pixels) {
        ASSERT_NE(value, 65535) << "0 is the only invalid depth";
      }
    }
  }
  camera.set_tap(nullptr);
  ASSERT_EQ(taken_count, frames_count);
  const CameraCounters& after = camera.counters();
  EXPECT_EQ(witness.unusable_count, 0);
  EXPECT_EQ(after.frames_delivered - before.frames_delivered, static_cast<std::uint64_t>(frames_count));
  EXPECT_GE(after.frames_missing + after.frames_rejected + after.timestamps_rejected -
                (before.frames_missing + before.frames_rejected + before.timestamps_rejected),
            gaps)
      << "a gap in the numbers is counted";
}

}  // namespace tactus::hal::conformance
