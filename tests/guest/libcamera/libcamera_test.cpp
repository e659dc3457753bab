// The backend on cameras that libcamera really drives. Skips where it sees none. A helper that can unplug the camera and
// plug it in again says how in TACTUS_GUEST_UNPLUG and TACTUS_GUEST_PLUG, two shell commands.
#include "hal/libcamera/libcamera.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cinttypes>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <iterator>
#include <set>
#include <string>
#include <vector>

#include "rt/clock.hpp"
#include "rt/heap_guard.hpp"
#include "tests/conformance/live_rules.hpp"

namespace tactus::hal::libcamera {
namespace {

using rt::operator""_s;
using rt::operator""_ms;

// The emulated machine is some fifty times slower than a real one.
constexpr rt::Duration kPatience = 20_s;

rt::HostTime now() { return rt::Clock::monotonic().now(); }

std::ptrdiff_t open_files_count() {
  return std::distance(std::filesystem::directory_iterator("/proc/self/fd"), std::filesystem::directory_iterator());
}

class Witness final : public FrameTap {
 public:
  void take(Stream stream, const RawFrame& frame) noexcept override {
    is_colour = is_colour && stream == Stream::color;
    if (count < sequences.size()) sequences[count] = frame.header.sequence;
    bytes = frame.bytes.data();
    ++count;
  }
  std::array<std::uint64_t, 64> sequences{};
  std::size_t count = 0;
  bool is_colour = true;
  const std::uint8_t* bytes = nullptr;
};

/// Counts the heap calls of this thread outside of guest libraries while it exists.
class Fenced {
 public:
  Fenced() { rt::heap_guard::seal(); }
  ~Fenced() { rt::heap_guard::unseal(); }
  Fenced(const Fenced&) = delete;
  Fenced& operator=(const Fenced&) = delete;
  [[nodiscard]] std::uint64_t calls() const { return rt::heap_guard::thread_calls() - before_; }

 private:
  std::uint64_t before_ = rt::heap_guard::thread_calls();
  rt::RtScope scope_;
};

class GuestLibcamera : public testing::Test {
 protected:
  void SetUp() override {
    const DeviceList list = list_devices();
    if (list.devices.empty()) GTEST_SKIP() << "libcamera sees no camera: " << list.why_none;
    id_ = list.devices.front().source.substr(std::string("libcamera:").size());
  }
  [[nodiscard]] rt::Result<LiveCamera<ColorCamera>> open(const LibcameraRequest& request = {}) {
    auto live = open_color(request);
    if (live) rgb_.resize(3 * static_cast<std::size_t>(live->width) * static_cast<std::size_t>(live->height));
    return live;
  }
  /// Reads until a frame comes; rejected ones in between are the counters' business.
  rt::Status read_good(ColorCamera& camera, FrameHeader& header) {
    const rt::HostTime deadline = now() + kPatience;
    rt::Status status = rt::Status::timeout;
    while (status != rt::Status::ok && now() < deadline) status = camera.read(rgb_, header, 100_ms);
    return status;
  }

  std::string id_;
  std::vector<std::uint8_t> rgb_;
};

TEST_F(GuestLibcamera, DevicesListTheCameraWithItsFormats) {
  const DeviceList list = list_devices();
  EXPECT_EQ(list.why_none, "");
  for (const DeviceEntry& entry : list.devices) {
    EXPECT_TRUE(entry.source.starts_with("libcamera:")) << entry.source;
    EXPECT_FALSE(entry.name.empty());
    EXPECT_FALSE(entry.formats.empty());
    EXPECT_EQ(entry.trouble, "");
    std::printf("%s: %s\n", entry.source.c_str(), entry.name.c_str());
    for (const std::string& format : entry.formats) std::printf("  %s\n", format.c_str());
  }
}

TEST_F(GuestLibcamera, FramesComeInOrderOnTheMonotonicClock) {
  auto sut = open();
  ASSERT_TRUE(sut) << sut.error().message;
  std::printf("%s, %zu bytes of buffers\n", sut->description.c_str(), sut->buffers_bytes);
  EXPECT_TRUE(sut->has_host_clock);
  EXPECT_GE(sut->buffers_bytes, rgb_.size() / 3) << "at least one byte a pixel";
  FrameHeader last;
  std::set<std::vector<std::uint8_t>> pictures;
  for (int i = 0; i < 10; ++i) {
    FrameHeader header;
    ASSERT_EQ(read_good(*sut->camera, header), rt::Status::ok) << i << ' ' << sut->camera->counters().first_rejection;
    if (i > 0) {
      EXPECT_LT(last.time, header.time);
      EXPECT_LT(last.sequence, header.sequence);
      EXPECT_LT(last.arrived, header.arrived);
    }
    EXPECT_LE(header.time.ns, header.arrived.ns) << "taken before it came";
    EXPECT_LT(header.arrived.ns - header.time.ns, (10_s).ns) << "the same clock";
    EXPECT_LE(header.arrived, now());
    last = header;
    pictures.insert(rgb_);
  }
  const CameraCounters& counters = sut->camera->counters();
  EXPECT_EQ(counters.frames_delivered, 10U);
  EXPECT_EQ(counters.timestamps_rejected, 0U);
  EXPECT_EQ(counters.losses, 0U);
  std::printf("%zu different pictures, %" PRIu64 " missing, %" PRIu64 " rejected\n", pictures.size(),
              counters.frames_missing, counters.frames_rejected);
  const auto [darkest, brightest] = std::minmax_element(rgb_.begin(), rgb_.end());
  EXPECT_LT(*darkest, *brightest) << "a picture of one colour";
}

TEST_F(GuestLibcamera, ColourKeepsTheRulesOfEveryCamera) {
  auto sut = open();
  ASSERT_TRUE(sut) << sut.error().message;
  conformance::expect_live_rules(*sut->camera, sut->width, sut->height, 12);
}

TEST_F(GuestLibcamera, PeekAnnouncesWhatReadGivesAndSkipPassesOver) {
  auto sut = open();
  ASSERT_TRUE(sut) << sut.error().message;
  Witness witness;
  sut->camera->set_tap(&witness);
  std::vector<std::uint64_t> sequences;
  for (int i = 0; i < 12; ++i) {
    FrameHeader announced, again, header;
    rt::Status status = rt::Status::timeout;
    for (int tries = 0; status != rt::Status::ok && tries < 200; ++tries) status = sut->camera->peek(announced, 100_ms);
    ASSERT_EQ(status, rt::Status::ok);
    ASSERT_EQ(sut->camera->peek(again, {}), rt::Status::ok);
    EXPECT_EQ(again.sequence, announced.sequence) << "a look takes nothing";
    sequences.push_back(announced.sequence);
    if (i % 2 == 0) {
      sut->camera->skip();
      continue;
    }
    ASSERT_EQ(sut->camera->read(rgb_, header, {}), rt::Status::ok);
    EXPECT_EQ(header.sequence, announced.sequence);
    EXPECT_EQ(header.time, announced.time);
  }
  EXPECT_EQ(sut->camera->counters().frames_delivered, 12U);
  ASSERT_EQ(witness.count, sequences.size()) << "each once";
  EXPECT_TRUE(std::equal(sequences.begin(), sequences.end(), witness.sequences.begin()));
  EXPECT_TRUE(witness.is_colour);
}

TEST_F(GuestLibcamera, RequestsAndBuffersAreReusedWithoutHeapCallsOfOurs) {
  auto sut = open();
  ASSERT_TRUE(sut) << sut.error().message;
  if (!rt::heap_guard::is_active()) GTEST_SKIP() << "this build brings its own malloc, heap calls are not seen";
  Witness witness;
  sut->camera->set_tap(&witness);
  FrameHeader header;
  ASSERT_EQ(read_good(*sut->camera, header), rt::Status::ok);
  const auto files_before = open_files_count();
  std::array<const std::uint8_t*, 24> buffers{};
  const std::uint64_t guest_before = rt::heap_guard::was_guest_calls();
  std::uint64_t calls = 0;
  rt::Status status = rt::Status::ok;
  {
    const Fenced fence;
    for (std::size_t i = 0; status == rt::Status::ok && i < buffers.size(); ++i) {
      status = read_good(*sut->camera, header);
      buffers[i] = witness.bytes;
    }
    calls = fence.calls();
  }
  ASSERT_EQ(status, rt::Status::ok);
  EXPECT_EQ(calls, 0U);
  std::printf("%" PRIu64 " heap calls of libcamera on the reading thread for %zu frames\n",
              rt::heap_guard::was_guest_calls() - guest_before, buffers.size());
  EXPECT_GT(rt::heap_guard::was_guest_calls(), guest_before) << "the fence sees what libcamera does";
  EXPECT_EQ(open_files_count(), files_before) << "a buffer is a file";
  EXPECT_LE(std::set<const std::uint8_t*>(buffers.begin(), buffers.end()).size(), 8U) << "the same few mappings";
  EXPECT_LT(header.sequence, 100'000U);
}

TEST_F(GuestLibcamera, WithoutReaderTheNewestWaitTheRestIsMissingAndTheDeviceGoesOn) {
  auto sut = open();
  ASSERT_TRUE(sut) << sut.error().message;
  FrameHeader first, header;
  ASSERT_EQ(read_good(*sut->camera, first), rt::Status::ok);
  const std::uint64_t missing_before = sut->camera->counters().frames_missing;
  const rt::HostTime woken = first.arrived + 3_s;
  rt::Clock::monotonic().sleep_until(woken);
  ASSERT_EQ(read_good(*sut->camera, header), rt::Status::ok);
  EXPECT_GT(header.arrived, first.arrived + 1_s) << "not one of long ago";
  EXPECT_GT(header.sequence, first.sequence + 1);
  const CameraCounters& counters = sut->camera->counters();
  EXPECT_EQ(counters.frames_missing - missing_before + counters.frames_rejected, header.sequence - first.sequence - 1);
  for (int i = 0; i < 4; ++i) ASSERT_EQ(read_good(*sut->camera, header), rt::Status::ok) << "frame " << i;
  EXPECT_GT(header.arrived, woken) << "the device has not starved";
}

TEST_F(GuestLibcamera, OpenCameraIsRefusedToASecondAndFreeAgainWhenClosed) {
  const auto files_before = open_files_count();
  for (int round = 0; round < 3; ++round) {
    auto sut = open();
    ASSERT_TRUE(sut) << sut.error().message;
    const auto second = open_color({});
    ASSERT_FALSE(second);
    EXPECT_EQ(second.error().code, rt::ExitCode::device_unavailable);
    EXPECT_NE(second.error().message.find("in use"), std::string::npos) << second.error().message;
    const DeviceList list = list_devices();
    ASSERT_FALSE(list.devices.empty()) << "listed while it runs";
    EXPECT_NE(list.devices.front().trouble.find("in use"), std::string::npos) << list.devices.front().trouble;
    FrameHeader header;
    EXPECT_EQ(read_good(*sut->camera, header), rt::Status::ok) << "the refusal disturbs nobody";
  }
  EXPECT_EQ(open_files_count(), files_before);
}

TEST_F(GuestLibcamera, PartOfAnIdIsEnoughAndAWrongOneIsRefused) {
  {
    const auto sut = open({.id = id_.substr(id_.size() / 2), .mode = {}, .format = "", .controls = {}});
    if (list_devices().devices.size() == 1) {
      EXPECT_TRUE(sut) << sut.error().message;
    }
  }
  const auto refused = open_color({.id = "no such camera", .mode = {}, .format = "", .controls = {}});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, rt::ExitCode::device_unavailable);
  EXPECT_NE(refused.error().message.find(id_), std::string::npos) << refused.error().message;
}

TEST_F(GuestLibcamera, ControlsAreSetByNameAndUnknownOnesRefusedWithTheNamesThereAre) {
  const auto refused = open_color({.id = "", .mode = {}, .format = "", .controls = {{"NoSuchControl", "1"}}});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, rt::ExitCode::bad_usage);
  std::printf("%s\n", refused.error().message.c_str());
  if (refused.error().message.find("Brightness ") == std::string::npos) return;  // nothing that every camera has
  EXPECT_FALSE(open_color({.id = "", .mode = {}, .format = "", .controls = {{"Brightness", "99"}}}));
  auto sut = open({.id = "", .mode = {}, .format = "", .controls = {{"Brightness", "0"}}});
  ASSERT_TRUE(sut) << sut.error().message;
  FrameHeader header;
  EXPECT_EQ(read_good(*sut->camera, header), rt::Status::ok);
}

TEST_F(GuestLibcamera, UnpluggedCameraIsLostAtOnceAndFoundAgain) {
  const char* unplug = std::getenv("TACTUS_GUEST_UNPLUG");
  const char* plug = std::getenv("TACTUS_GUEST_PLUG");
  if (unplug == nullptr || plug == nullptr)
    GTEST_SKIP() << "TACTUS_GUEST_UNPLUG and TACTUS_GUEST_PLUG do not say how to unplug it";
  auto sut = open();
  ASSERT_TRUE(sut) << sut.error().message;
  for (std::uint64_t round = 1; round <= 2; ++round) {
    FrameHeader last, header;
    for (int i = 0; i < 5; ++i) ASSERT_EQ(read_good(*sut->camera, last), rt::Status::ok);
    ASSERT_EQ(std::system(unplug), 0) << unplug;
    const rt::HostTime unplugged = now();
    rt::Status status = rt::Status::ok;
    while (status != rt::Status::device_lost && now() < unplugged + kPatience) {
      status = sut->camera->read(rgb_, header, 100_ms);
      if (status == rt::Status::ok) last = header;
    }
    ASSERT_EQ(status, rt::Status::device_lost);
    std::printf("lost %.0f ms after it was unplugged, %" PRIu64 " frames rejected\n", (now() - unplugged).milliseconds(),
                sut->camera->counters().frames_rejected);
    std::uint64_t calls = 0;
    {
      const Fenced fence;
      for (int i = 0; status == rt::Status::device_lost && i < 8; ++i) status = sut->camera->read(rgb_, header, 100_ms);
      for (int i = 0; status == rt::Status::device_lost && i < 3; ++i) status = sut->camera->peek(header, {});
      calls = fence.calls();
    }
    EXPECT_EQ(status, rt::Status::device_lost) << "it stays away";
    EXPECT_EQ(calls, 0U) << "libcamera allocates inside its scope alone";
    EXPECT_EQ(sut->camera->counters().losses, round) << "one loss is counted once";
    ASSERT_EQ(std::system(plug), 0) << plug;
    const rt::HostTime plugged = now();
    ASSERT_EQ(read_good(*sut->camera, header), rt::Status::ok);
    std::printf("a frame %.0f ms after it was plugged in again\n", (now() - plugged).milliseconds());
    EXPECT_GT(header.sequence, last.sequence);
    EXPECT_GT(header.time, last.time);
    EXPECT_EQ(sut->camera->counters().losses, round);
  }
}

}  // namespace
}  // namespace tactus::hal::libcamera
