// Lost frames, damaged frames and lost devices, by vivid's injected faults.
#include "rt/heap_guard.hpp"
#include "tests/guest/v4l2/vivid_fixture.hpp"

namespace tactus::hal::v4l2 {
namespace {

constexpr std::size_t kPixels = 320 * 180;

TEST_F(Vivid, DroppedFramesAreGapsAndCounted) {
  set(single[0], "percentage_of_dropped_buffers", "50");
  auto camera = depth(small_request(single[0]));
  std::vector<std::uint16_t> pixels(kPixels);
  FrameHeader first, last;
  ASSERT_EQ(camera.camera->read(pixels, first, kPatience), rt::Status::ok);
  std::uint64_t before = first.sequence, gaps = 0;
  for (int i = 0; i < 30; ++i) {
    ASSERT_EQ(camera.camera->read(pixels, last, kPatience), rt::Status::ok);
    ASSERT_GT(last.sequence, before);
    gaps += last.sequence - before - 1;
    before = last.sequence;
  }
  EXPECT_GT(gaps, 3U) << "of about 30";
  EXPECT_EQ(camera.camera->counters().frames_missing, gaps);
  EXPECT_EQ(last.sequence - first.sequence, 30 + gaps);
  EXPECT_EQ(camera.camera->counters().frames_rejected, 0U);
}

TEST_F(Vivid, FramesFromBeforeTheFirstReadAreNoLoss) {
  auto camera = depth(small_request(single[0]));
  rt::Clock::monotonic().sleep_until(rt::Clock::monotonic().now() + rt::Duration{1'500'000'000});
  std::vector<std::uint16_t> pixels(kPixels);
  FrameHeader header;
  const std::int64_t begin_ns = rt::Clock::monotonic().now().ns;
  ASSERT_EQ(camera.camera->read(pixels, header, kPatience), rt::Status::ok);
  EXPECT_GT(header.time.ns, begin_ns - 750'000'000) << "not one that waited in the queue";
  EXPECT_EQ(camera.camera->counters().frames_missing, 0U);
}

TEST_F(Vivid, SequenceGoesOnWhereTheDriversCounterWraps) {
  set(single[0], "wrap_sequence_number", "1");
  V4l2Request request = small_request(single[0]);
  request.mode.frame_rate_hz = 60;
  auto camera = depth(request);
  std::vector<std::uint16_t> pixels(kPixels);
  FrameHeader header;
  ASSERT_EQ(camera.camera->read(pixels, header, kPatience), rt::Status::ok);
  ASSERT_LT(header.sequence, std::uint64_t{1} << 32) << "the driver starts 128 before its wrap";
  ASSERT_GT(header.sequence, (std::uint64_t{1} << 32) - 129);
  std::uint64_t before = header.sequence;
  for (int i = 0; i < 200 && before < std::uint64_t{1} << 32; ++i) {
    ASSERT_EQ(camera.camera->read(pixels, header, kPatience), rt::Status::ok);
    ASSERT_GT(header.sequence, before);
    ASSERT_LT(header.sequence, before + 120);
    before = header.sequence;
  }
  EXPECT_GE(before, std::uint64_t{1} << 32);
}

TEST_F(Vivid, FrameFlaggedAsDamagedIsRejectedAndTheNextIsGood) {
  auto camera = depth(small_request(single[0]));
  std::vector<std::uint16_t> pixels(kPixels);
  FrameHeader header;
  ASSERT_EQ(camera.camera->read(pixels, header, kPatience), rt::Status::ok);
  set(single[0], "inject_v4l2_buf_flag_error", "1");
  int corrupt_count = 0;
  for (int i = 0; i < 12; ++i) {
    const rt::Status status = camera.camera->read(pixels, header, kPatience);
    corrupt_count += status == rt::Status::corrupt ? 1 : 0;
    ASSERT_TRUE(status == rt::Status::ok || status == rt::Status::corrupt);
  }
  EXPECT_EQ(corrupt_count, 1);
  const CameraCounters& counters = camera.camera->counters();
  EXPECT_EQ(counters.frames_rejected, 1U);
  EXPECT_EQ(counters.frames_delivered, 12U);
  EXPECT_EQ(counters.losses, 0U);
  EXPECT_TRUE(counters.first_rejection.starts_with(single[0].path + ": frame ")) << counters.first_rejection;
  EXPECT_TRUE(counters.first_rejection.ends_with(" is flagged as damaged by the driver")) << counters.first_rejection;
}

TEST_F(Vivid, BufferThatTheDriverRefusesIsOfferedAgain) {
  auto camera = depth(small_request(single[0]));
  std::vector<std::uint16_t> pixels(kPixels);
  FrameHeader header;
  for (int round = 0; round < 6; ++round) {
    set(single[0], "inject_vidioc_qbuf_error", "1");
    for (int i = 0; i < 3; ++i) ASSERT_EQ(camera.camera->read(pixels, header, kPatience), rt::Status::ok) << round;
  }
  EXPECT_EQ(camera.camera->counters().losses, 0U) << "more refusals than there are buffers";
  EXPECT_EQ(camera.camera->counters().frames_delivered, 18U);
}

TEST_F(Vivid, DriverThatDoesNotStartIsASentenceAndMayStartLater) {
  set(single[0], "inject_vidioc_streamon_error", "1");
  EXPECT_EQ(depth_refusal(small_request(single[0])),
            single[0].path + " (vivid) does not start (VIDIOC_STREAMON: Invalid argument); unplug it and plug it in again");
  EXPECT_EQ(depth(small_request(single[0])).width, 320);
  set(single[0], "inject_vidioc_reqbufs_error", "1");
  EXPECT_EQ(depth_refusal(small_request(single[0])),
            single[0].path + " (vivid) gives no buffers (VIDIOC_REQBUFS: Invalid argument); try a smaller size");
  EXPECT_EQ(depth(small_request(single[0])).width, 320);
}

/// Reads until frames come again after `lose`; all that may happen on the way.
template <typename Lose>
void expect_comes_back(LiveCamera<DepthCamera>& camera, const Lose& lose) {
  std::vector<std::uint16_t> pixels(kPixels);
  FrameHeader before, header;
  for (int i = 0; i < 5; ++i) ASSERT_EQ(camera.camera->read(pixels, before, kPatience), rt::Status::ok);
  lose();
  const std::uint64_t heap_before = rt::heap_guard::was_total_calls();
  rt::heap_guard::seal();
  int lost_count = 0, good_count = 0, other_count = 0;
  {
    const rt::RtScope scope;
    for (int i = 0; i < 400 && good_count < 5; ++i) {
      const rt::Status status = camera.camera->read(pixels, header, rt::Duration{100'000'000});
      if (status == rt::Status::device_lost) {
        ++lost_count;
      } else if (status == rt::Status::ok) {
        // Frames that were filled before the loss may still come.
        if (header.sequence <= before.sequence || header.time <= before.time) ++other_count;
        before = header;
        good_count += lost_count > 0 ? 1 : 0;
      } else if (status != rt::Status::timeout) {
        ++other_count;
      }
    }
  }
  rt::heap_guard::unseal();
  EXPECT_GT(lost_count, 0);
  EXPECT_EQ(good_count, 5);
  EXPECT_EQ(other_count, 0) << "numbers and times rise across the loss, and nothing else is answered";
  EXPECT_EQ(camera.camera->counters().losses, 1U);
  EXPECT_EQ(rt::heap_guard::was_total_calls() - heap_before, 0U);
}

TEST_F(Vivid, DeviceThatIsUnpluggedComesBackInTheSameMode) {
  const FoundNode exporter = single.size() > 1 ? single[1] : multi.empty() ? single[0] : multi[0];
  for (const Buffers kind : {Buffers::mmap, Buffers::userptr, Buffers::dmabuf}) {
    V4l2Request request = small_request(single[0], "Y12");
    request.buffers = kind;
    if (kind == Buffers::dmabuf) request.dmabuf_exporter = exporter.path;
    request.controls = {{"brightness", "99"}};
    auto camera = depth(request);
    expect_comes_back(camera, [&] { set(single[0], "disconnect", "1"); });
    EXPECT_EQ(get(single[0], "brightness"), 99);
  }
}

TEST_F(Vivid, MultiplanarDeviceThatIsUnpluggedComesBack) {
  if (multi.empty()) GTEST_SKIP() << "no multi-planar vivid; load it with n_devs=2 multiplanar=1,2";
  auto camera = depth(small_request(multi[0], "Y16"));
  expect_comes_back(camera, [&] { set(multi[0], "disconnect", "1"); });
}

TEST_F(Vivid, StreamWithAFatalErrorIsStartedAnew) {
  auto camera = depth(small_request(single[0]));
  expect_comes_back(camera, [&] { set(single[0], "inject_fatal_streaming_error", "1"); });
}

}  // namespace
}  // namespace tactus::hal::v4l2
