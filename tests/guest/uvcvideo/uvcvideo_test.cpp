// A USB camera of our own on this machine's kernel, read through hal/v4l2. Needs root, vhci-hcd and uvcvideo; run by
// toolchains/guest-test.sh.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <map>
#include <random>
#include <thread>

#include "hal/frames/convert.hpp"
#include "hal/v4l2/v4l2.hpp"
#include "rt/clock.hpp"
#include "tests/guest/usb_camera/usb_camera.hpp"
#include "tests/guest/uvcvideo/video_nodes.hpp"

namespace tactus::guest {
namespace {

using namespace rt::literals;

constexpr int kWidth = 320, kHeight = 240;
constexpr std::size_t kPixels = std::size_t{kWidth} * kHeight, kFramesCount = 7;
constexpr rt::Duration kPatience = 60_s;  // an emulated machine on a busy one
constexpr const char* kName = "tactus test camera";

rt::HostTime now() { return rt::Clock::monotonic().now(); }

// Every byte is its own: what is torn, shifted or left over cannot look right.
std::shared_ptr<const Clip> noise() {
  auto clip = std::make_shared<Clip>(kWidth, kHeight);
  std::mt19937 random(17);
  std::vector<std::uint8_t> depth(2 * kPixels), yuyv(2 * kPixels);
  for (std::size_t i = 0; i < kFramesCount; ++i) {
    for (std::uint8_t& byte : depth) byte = static_cast<std::uint8_t>(random());
    for (std::uint8_t& byte : yuyv) byte = static_cast<std::uint8_t>(random());
    clip->append(depth, yuyv);
  }
  return clip;
}

CameraSpec spec(std::vector<double> frame_rates_hz) {
  CameraSpec camera{kName, "1", {{hal::PixelFormat::depth16, kWidth, kHeight}, {hal::PixelFormat::yuyv, kWidth, kHeight}}, {}};
  for (const double rate_hz : frame_rates_hz)
    camera.frame_intervals.push_back(static_cast<std::uint32_t>(1e7 / rate_hz + 0.5));
  return camera;
}

// Which of the clip's frames the newest is, by its bytes as they came.
class Witness final : public hal::FrameTap {
 public:
  explicit Witness(const Clip& clip) : clip_(clip) {}
  void take(hal::Stream stream, const hal::RawFrame& frame) noexcept override {
    const auto format = stream == hal::Stream::depth ? hal::PixelFormat::depth16 : hal::PixelFormat::yuyv;
    ++count;
    index = kNever;
    for (std::size_t i = 0; i < clip_.frames_count(); ++i) {
      const auto sent = clip_.frame(format, i);
      if (frame.format == format && sent.size() == frame.bytes.size() &&
          std::memcmp(sent.data(), frame.bytes.data(), sent.size()) == 0)
        index = i;
    }
  }
  std::size_t count = 0, index = kNever;  // kNever: none of them, byte for byte

 private:
  const Clip& clip_;
};

class GuestUvcvideo : public testing::Test {
 protected:
  // The kernel's own answer to broken frames is to drop them; nodrop hands them on, marked.
  void plug(std::vector<double> frame_rates_hz, const PlayOptions& options, bool hands_on_broken_frames = false) {
    std::ofstream nodrop("/sys/module/uvcvideo/parameters/nodrop");
    nodrop << (hands_on_broken_frames ? "1\n" : "0\n");
    nodrop.close();
    if (!nodrop) GTEST_SKIP() << "uvcvideo is not loaded, or this is not root";
    camera_.emplace(spec(std::move(frame_rates_hz)), clip_, 0);
    const auto plugged = camera_->plug(options);
    ASSERT_TRUE(plugged) << plugged.error().message;
    nodes_ = await_video_nodes(kName, 2, kPatience);
    ASSERT_EQ(nodes_.size(), 2u) << "nodes of the camera";
  }
  static hal::v4l2::V4l2Request request(const std::string& node, double frame_rate_hz = 0) {
    hal::v4l2::V4l2Request r;
    r.device = node;
    r.mode.frame_rate_hz = frame_rate_hz;
    return r;
  }
  void TearDown() override {
    // The next test's nodes are to be its own.
    camera_.reset();
    const rt::HostTime end = now() + kPatience;
    while (!video_nodes(kName).empty() && now() < end) std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  // A frame, or what came instead of one.
  rt::Status read(hal::DepthCamera& camera, hal::FrameHeader& header) {
    const rt::HostTime end = now() + kPatience;
    rt::Status status = rt::Status::timeout;
    while (status == rt::Status::timeout && now() < end) status = camera.read(depth_, header, 500_ms);
    return status;
  }
  rt::Status read(hal::ColorCamera& camera, hal::FrameHeader& header) {
    const rt::HostTime end = now() + kPatience;
    rt::Status status = rt::Status::timeout;
    while (status == rt::Status::timeout && now() < end) status = camera.read(rgb_, header, 500_ms);
    return status;
  }
  std::vector<std::uint16_t> sent_depth(std::size_t index) const {
    std::vector<std::uint16_t> depth(kPixels);
    EXPECT_EQ(hal::frames::to_depth(raw(hal::PixelFormat::depth16, index), depth), rt::Status::ok);
    return depth;
  }
  std::vector<std::uint8_t> sent_rgb(std::size_t index) const {
    std::vector<std::uint8_t> rgb(3 * kPixels);
    EXPECT_EQ(hal::frames::to_rgb(raw(hal::PixelFormat::yuyv, index), rgb), rt::Status::ok);
    return rgb;
  }
  hal::RawFrame raw(hal::PixelFormat format, std::size_t index) const {
    return {{}, format, kWidth, kHeight, 2 * static_cast<std::size_t>(kWidth), clip_->frame(format, index)};
  }

  std::shared_ptr<const Clip> clip_ = noise();
  std::optional<UsbCamera> camera_;
  std::vector<std::string> nodes_;
  std::vector<std::uint16_t> depth_ = std::vector<std::uint16_t>(kPixels);
  std::vector<std::uint8_t> rgb_ = std::vector<std::uint8_t>(3 * kPixels);
};

TEST_F(GuestUvcvideo, BothStreamsArriveByteForByteInOrderAndWhole) {
  plug({5}, {});
  if (IsSkipped() || HasFatalFailure()) return;
  auto depth = hal::v4l2::open_depth(request(nodes_[0]));
  ASSERT_TRUE(depth) << depth.error().message;
  auto color = hal::v4l2::open_color(request(nodes_[1]));
  ASSERT_TRUE(color) << color.error().message;
  std::printf("%s\n%s\n", depth->description.c_str(), color->description.c_str());
  EXPECT_EQ(depth->width, kWidth);
  EXPECT_EQ(color->height, kHeight);
  EXPECT_TRUE(depth->has_host_clock);
  Witness depth_witness(*clip_), color_witness(*clip_);
  depth->camera->set_tap(&depth_witness);
  color->camera->set_tap(&color_witness);
  hal::FrameHeader depth_last, color_last, header;
  double stamp_error_ms_max = 0;
  std::map<std::size_t, rt::HostTime> shown;  // by place in the clip, the newest
  for (std::size_t i = 0; i < 2 * kFramesCount; ++i) {
    SCOPED_TRACE("frame " + std::to_string(i));
    const std::size_t depth_before = depth_witness.index, color_before = color_witness.index;
    ASSERT_EQ(read(*depth->camera, header), rt::Status::ok);
    const rt::HostTime read_at = now();
    ASSERT_NE(depth_witness.index, kNever) << "depth is not what was sent";
    EXPECT_EQ(depth_, sent_depth(depth_witness.index));
    for (const ShownFrame& frame : camera_->take_shown()) shown[frame.frame % kFramesCount] = frame.time;
    EXPECT_GE(header.arrived, shown[depth_witness.index]) << "it cannot have arrived before it was sent";
    EXPECT_LE(header.arrived, read_at);
    // By the camera's own clock, from the stamps in its payloads: when it was taken.
    const double error_ms = rt::Duration{header.time.ns - shown[depth_witness.index].ns}.milliseconds();
    stamp_error_ms_max = std::max(stamp_error_ms_max, std::abs(error_ms));
    if (i > 0) {
      EXPECT_EQ(depth_witness.index, (depth_before + 1) % kFramesCount);
      EXPECT_EQ(header.sequence, depth_last.sequence + 1);
      EXPECT_GT(header.time, depth_last.time);
    }
    depth_last = header;
    ASSERT_EQ(read(*color->camera, header), rt::Status::ok);
    ASSERT_NE(color_witness.index, kNever) << "colour is not what was sent";
    EXPECT_EQ(rgb_, sent_rgb(color_witness.index));
    if (i > 0) {
      EXPECT_EQ(color_witness.index, (color_before + 1) % kFramesCount);
      EXPECT_EQ(header.sequence, color_last.sequence + 1);
      EXPECT_GT(header.time, color_last.time);
    }
    color_last = header;
  }
  for (const hal::CameraCounters* counters : {&depth->camera->counters(), &color->camera->counters()}) {
    EXPECT_EQ(counters->frames_delivered, 2 * kFramesCount);
    EXPECT_EQ(counters->frames_missing, 0u);
    EXPECT_EQ(counters->frames_rejected, 0u) << counters->first_rejection;
    EXPECT_EQ(counters->timestamps_rejected, 0u);
  }
  EXPECT_EQ(depth_witness.count, 2 * kFramesCount);
  std::printf("times at most %.1f ms beside those at which the camera took the frames\n", stamp_error_ms_max);
  EXPECT_LT(stamp_error_ms_max, 1000) << "another clock";
}

TEST_F(GuestUvcvideo, RateThatWasAskedForIsTheCameras) {
  plug({5, 20}, {});
  if (IsSkipped() || HasFatalFailure()) return;
  auto depth = hal::v4l2::open_depth(request(nodes_[0], 20));
  ASSERT_TRUE(depth) << depth.error().message;
  EXPECT_NEAR(depth->frame_rate_hz, 20, 0.01);
  hal::FrameHeader first, last;
  ASSERT_EQ(read(*depth->camera, first), rt::Status::ok);
  (void)camera_->take_shown();
  for (int i = 0; i < 8; ++i) ASSERT_EQ(read(*depth->camera, last), rt::Status::ok);
  std::vector<ShownFrame> shown = camera_->take_shown();
  ASSERT_GE(shown.size(), 3u);
  // What the camera was told, by its own clock: at 5 Hz each step would be 200 ms.
  std::int64_t shortest_ns = (1_s).ns;
  for (std::size_t i = 1; i < shown.size(); ++i) shortest_ns = std::min(shortest_ns, (shown[i].time - shown[i - 1].time).ns);
  EXPECT_LT(shortest_ns, (150_ms).ns);
}

TEST_F(GuestUvcvideo, BrokenFramesThatTheDriverDropsAreMissing) {
  PlayOptions options;
  options.short_at = 4;
  options.error_at = 6;
  plug({5}, options);
  if (IsSkipped() || HasFatalFailure()) return;
  auto depth = hal::v4l2::open_depth(request(nodes_[0]));
  ASSERT_TRUE(depth) << depth.error().message;
  Witness witness(*clip_);
  depth->camera->set_tap(&witness);
  hal::FrameHeader header;
  std::vector<std::size_t> frames;
  while (frames.empty() || frames.back() < 8) {
    ASSERT_EQ(read(*depth->camera, header), rt::Status::ok) << depth->camera->counters().first_rejection;
    ASSERT_NE(witness.index, kNever) << "a broken frame was delivered";
    std::size_t frame = witness.index;
    while (!frames.empty() && frame <= frames.back()) frame += kFramesCount;
    frames.push_back(frame);
  }
  EXPECT_EQ(std::count(frames.begin(), frames.end(), 4u) + std::count(frames.begin(), frames.end(), 6u), 0);
  EXPECT_EQ(depth->camera->counters().frames_missing, 2u);
  EXPECT_EQ(depth->camera->counters().frames_rejected, 0u);
}

TEST_F(GuestUvcvideo, BrokenFramesThatTheDriverHandsOnAreRejected) {
  PlayOptions options;
  options.short_at = 4;
  options.error_at = 6;
  plug({5}, options, true);
  if (IsSkipped() || HasFatalFailure()) return;
  auto color = hal::v4l2::open_color(request(nodes_[1]));
  ASSERT_TRUE(color) << color.error().message;
  Witness witness(*clip_);
  color->camera->set_tap(&witness);
  hal::FrameHeader header;
  std::uint64_t last_sequence = 0;
  int corrupt_count = 0;
  while (last_sequence < 8) {
    const rt::Status status = read(*color->camera, header);
    if (status == rt::Status::corrupt) {
      ++corrupt_count;
      continue;
    }
    ASSERT_EQ(status, rt::Status::ok);
    EXPECT_NE(witness.index, kNever) << "a broken frame was delivered";
    last_sequence = header.sequence;
  }
  EXPECT_EQ(corrupt_count, 2);
  EXPECT_EQ(color->camera->counters().frames_rejected, 2u);
  EXPECT_FALSE(color->camera->counters().first_rejection.empty());
  std::printf("%s\n", color->camera->counters().first_rejection.c_str());
}

TEST_F(GuestUvcvideo, UnpluggedInMidStreamIsLostOnceAndComesBack) {
  PlayOptions options;
  options.unplug_at = 5;
  plug({5}, options);
  if (IsSkipped() || HasFatalFailure()) return;
  auto depth = hal::v4l2::open_depth(request(nodes_[0]));
  ASSERT_TRUE(depth) << depth.error().message;
  Witness witness(*clip_);
  depth->camera->set_tap(&witness);
  hal::FrameHeader header, last;
  rt::Status status = rt::Status::ok;
  while (status == rt::Status::ok) {
    status = read(*depth->camera, header);
    if (status != rt::Status::ok) break;
    EXPECT_NE(witness.index, kNever);
    last = header;
  }
  ASSERT_EQ(status, rt::Status::device_lost);
  EXPECT_EQ(depth->camera->counters().losses, 1u);
  for (int i = 0; i < 5; ++i) EXPECT_EQ(depth->camera->read(depth_, header, 100_ms), rt::Status::device_lost);
  EXPECT_EQ(depth->camera->counters().losses, 1u);
  EXPECT_FALSE(camera_->is_plugged());

  const auto plugged = camera_->plug({});
  ASSERT_TRUE(plugged) << plugged.error().message;
  const rt::HostTime end = now() + kPatience;
  while (status == rt::Status::device_lost && now() < end) status = depth->camera->read(depth_, header, 200_ms);
  if (status == rt::Status::timeout) status = read(*depth->camera, header);
  ASSERT_EQ(status, rt::Status::ok);
  for (int i = 0; i < 4; ++i) {
    ASSERT_NE(witness.index, kNever);
    EXPECT_EQ(depth_, sent_depth(witness.index));
    EXPECT_GT(header.sequence, last.sequence);
    EXPECT_GT(header.time, last.time);
    last = header;
    ASSERT_EQ(read(*depth->camera, header), rt::Status::ok);
  }
  EXPECT_EQ(depth->camera->counters().losses, 1u);
}

TEST_F(GuestUvcvideo, PulledOutWhileSomebodyWaitsIsLostBeforeTheWaitIsOver) {
  plug({0.2}, {});
  if (IsSkipped() || HasFatalFailure()) return;
  auto color = hal::v4l2::open_color(request(nodes_[1]));
  ASSERT_TRUE(color) << color.error().message;
  std::thread hand([this] {
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
    camera_->unplug();
  });
  hal::FrameHeader header;
  rt::Status status = rt::Status::ok;
  // The first frame may be there already; the next is 5 s away.
  while (status == rt::Status::ok) status = color->camera->read(rgb_, header, kPatience);
  hand.join();
  EXPECT_EQ(status, rt::Status::device_lost);
  EXPECT_EQ(color->camera->counters().losses, 1u);
}

}  // namespace
}  // namespace tactus::guest
