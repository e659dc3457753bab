// Recording and playing touch no heap on the thread that reads the cameras.
#include <gtest/gtest.h>

#include "rt/heap_guard.hpp"
#include "tests/hal/record/small_recording.hpp"

namespace tactus::hal::record {
namespace {

/// Calls of the malloc family while `step` runs on this thread.
template <typename Step>
std::uint64_t heap_calls(const Step& step) {
  rt::heap_guard::seal();
  const std::uint64_t before = rt::heap_guard::thread_calls();
  {
    const rt::RtScope scope;
    step();
  }
  const std::uint64_t calls = rt::heap_guard::thread_calls() - before;
  rt::heap_guard::unseal();
  return calls;
}

TEST(TacHeap, TakeTouchesNone) {
  if (!rt::heap_guard::is_active()) GTEST_SKIP() << "this build brings its own malloc; calls are not seen";
  const test::TemporaryFolder folder;
  for (const bool waits : {false, true}) {
    auto writer = TacWriter::create(folder.path() / (waits ? "a.tac" : "b.tac"), described_sensor(), {},
                                    {.color = TacColor::jpeg, .frames_waiting = 1, .waits_when_full = waits});
    ASSERT_TRUE(writer);
    const OwnedFrame depth = depth_frame(0), color = color_frame(PixelFormat::nv12, 0);
    const Bytes ids = labels_of(0);
    EXPECT_EQ(heap_calls([&] {
                for (int i = 0; i < 100; ++i) {
                  (*writer)->take(Stream::depth, depth.raw());
                  (*writer)->take(Stream::color, color.raw());
                  (void)(*writer)->add_labels(0, ids);
                }
              }),
              0U);
    ASSERT_TRUE((*writer)->close());
    const auto counts = (*writer)->was();
    EXPECT_EQ(counts.streams[0].written + counts.streams[0].dropped, 100U);
  }
}

class CountingTap final : public FrameTap {
 public:
  void take(Stream, const RawFrame& frame) noexcept override { bytes += frame.bytes.size(); }
  std::size_t bytes = 0;
};

TEST(TacHeap, ReadTouchesNoneUnlessTheSensorSaysSo) {
  if (!rt::heap_guard::is_active()) GTEST_SKIP() << "this build brings its own malloc; calls are not seen";
  const test::TemporaryFolder folder;
  for (const PixelFormat format :
       {PixelFormat::rgb24, PixelFormat::yuyv, PixelFormat::nv12, PixelFormat::mjpeg})
    for (const std::size_t prefetch : {std::size_t{0}, std::size_t{2}}) {
      const auto path = folder.path() / (std::to_string(static_cast<int>(format)) + std::to_string(prefetch) + ".tac");
      record(path, {.color = format});
      auto sensor = open_tac(path, {.prefetch = prefetch});
      ASSERT_TRUE(sensor) << sensor.error().message;
      CountingTap tap;
      sensor->depth->set_tap(&tap);
      sensor->color->set_tap(&tap);
      std::vector<std::uint16_t> depth(kPixels);
      Bytes rgb(3 * kPixels), ids(kPixels);
      std::uint64_t good_count = 0;
      const std::uint64_t calls = heap_calls([&] {
        FrameHeader header;
        for (std::uint64_t i = 0; i < 9; ++i) {
          good_count += sensor->depth->read(depth, header, kLong) == rt::Status::ok ? 1U : 0U;
          good_count += sensor->color->peek(header, kLong) == rt::Status::ok ? 1U : 0U;
          if (i % 2 == 0)
            good_count += sensor->color->read(rgb, header, kLong) == rt::Status::ok ? 1U : 0U;
          else
            sensor->color->skip();
          good_count += sensor->labels->read(i, ids) == rt::Status::ok ? 1U : 0U;
        }
      });
      EXPECT_EQ(good_count, 9 + 9 + 5 + 9U);
      EXPECT_GT(tap.bytes, 9 * 2 * kPixels);
      if (!sensor->allocates_in_read) {
        EXPECT_EQ(calls, 0U) << "format " << static_cast<int>(format) << ", prefetch " << prefetch;
      } else {
        EXPECT_GT(calls, 0U) << "then it need not say so";
      }
    }
}

}  // namespace
}  // namespace tactus::hal::record
