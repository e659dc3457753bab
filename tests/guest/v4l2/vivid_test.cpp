// What V4L2 cameras give, shown on vivid.
#include <fcntl.h>
#include <linux/videodev2.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>

#include "hal/frames/convert.hpp"
#include "rt/heap_guard.hpp"
#include "tests/conformance/live_rules.hpp"
#include "tests/guest/v4l2/vivid_fixture.hpp"

namespace tactus::hal::v4l2 {
namespace {

constexpr std::size_t kPixels = 320 * 180;

/// The bytes of one frame by read(2), a way that the backend does not use.
std::vector<std::uint8_t> frame_by_read(const FoundNode& node, std::uint32_t fourcc, std::size_t bytes) {
  int error = 0;
  const Descriptor fd = open_node(node.path.c_str(), error);
  v4l2_format format{};
  format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  format.fmt.pix.width = 320;
  format.fmt.pix.height = 180;
  format.fmt.pix.pixelformat = fourcc;
  EXPECT_EQ(call(fd.get(), VIDIOC_S_FMT, &format), 0);
  EXPECT_EQ(format.fmt.pix.sizeimage, bytes);
  std::vector<std::uint8_t> out(bytes);
  ssize_t got = -1;
  for (int i = 0; i < 100 && got < 0; ++i) {
    got = ::read(fd.get(), out.data(), out.size());
    pollfd waited{fd.get(), POLLIN, 0};
    if (got < 0) (void)::poll(&waited, 1, 1000);
  }
  EXPECT_EQ(got, static_cast<ssize_t>(bytes));
  return out;
}

std::vector<std::uint16_t> depth_frame(const V4l2Request& request) {
  auto camera = open_depth(request);
  std::vector<std::uint16_t> pixels(kPixels);
  if (!camera) {
    ADD_FAILURE() << camera.error().message;
    return pixels;
  }
  FrameHeader header;
  for (int i = 0; i < 6; ++i) {
    std::fill(pixels.begin(), pixels.end(), std::uint16_t{0xbeef});
    EXPECT_EQ(camera->camera->read(pixels, header, kPatience), rt::Status::ok) << camera->description;
  }
  EXPECT_EQ(camera->camera->counters().frames_delivered, 6U);
  EXPECT_EQ(camera->camera->counters().frames_rejected, 0U) << camera->camera->counters().first_rejection;
  EXPECT_GE(camera->buffers_bytes, 4 * 2 * kPixels);
  return pixels;
}

std::vector<std::uint8_t> color_frame(const V4l2Request& request) {
  auto camera = open_color(request);
  std::vector<std::uint8_t> pixels(3 * kPixels);
  if (!camera) {
    ADD_FAILURE() << camera.error().message;
    return pixels;
  }
  FrameHeader header;
  for (int i = 0; i < 6; ++i) {
    std::fill(pixels.begin(), pixels.end(), std::uint8_t{0x5a});
    EXPECT_EQ(camera->camera->read(pixels, header, kPatience), rt::Status::ok) << camera->description;
  }
  EXPECT_EQ(camera->camera->counters().frames_rejected, 0U) << camera->camera->counters().first_rejection;
  return pixels;
}

/// Every way to bring buffers to `node`; the exporter of DMA-BUFs is another vivid.
std::vector<V4l2Request> every_kind(const FoundNode& node, const std::vector<FoundNode>& others, const std::string& format) {
  std::vector<V4l2Request> out(2, small_request(node, format));
  out[1].buffers = Buffers::userptr;
  for (const FoundNode& other : others) {
    if (other.path == node.path) continue;
    out.push_back(small_request(node, format));
    out.back().buffers = Buffers::dmabuf;
    out.back().dmabuf_exporter = other.path;
  }
  return out;
}

TEST_F(Vivid, DepthIsWhatTheDriverWroteThroughEveryKindOfBuffer) {
  std::vector<FoundNode> all = single;
  all.insert(all.end(), multi.begin(), multi.end());
  for (const auto& [format, fourcc] : {std::pair{"Y16", V4L2_PIX_FMT_Y16}, std::pair{"Y12", V4L2_PIX_FMT_Y12}}) {
    const std::vector<std::uint8_t> raw = frame_by_read(single[0], fourcc, 2 * kPixels);
    std::vector<std::uint16_t> expected(kPixels);
    for (std::size_t i = 0; i < kPixels; ++i) {
      expected[i] = static_cast<std::uint16_t>(raw[2 * i] | raw[2 * i + 1] << 8);
      if (expected[i] == 65535) expected[i] = 0;
    }
    EXPECT_NE(expected.front(), expected[300]) << "bars of different brightness";
    int ways_count = 0;
    for (const FoundNode& node : {single.front(), all.back()})
      for (const V4l2Request& request : every_kind(node, all, format)) {
        EXPECT_TRUE(depth_frame(request) == expected)
            << format << " of " << request.device << ", buffers " << static_cast<int>(request.buffers) << " "
            << request.dmabuf_exporter;
        ++ways_count;
      }
    EXPECT_GE(ways_count, 6) << "load vivid with two devices, n_devs=2";
  }
}

TEST_F(Vivid, ColourIsItsBarsThroughEveryKindOfBuffer) {
  std::vector<FoundNode> all = single;
  all.insert(all.end(), multi.begin(), multi.end());
  // The 75 % colour bars, left to right, in the middle of each.
  constexpr std::array<std::array<int, 3>, 8> kBars{
      {{191, 191, 191}, {191, 191, 0}, {0, 191, 191}, {0, 191, 0}, {191, 0, 191}, {191, 0, 0}, {0, 0, 191}, {0, 0, 0}}};
  for (const std::string format : {"YUYV", "NV12", "RGB3"}) {
    std::vector<std::uint8_t> first;
    for (const FoundNode& node : {single.front(), all.back()})
      for (const V4l2Request& request : every_kind(node, all, format)) {
        const std::vector<std::uint8_t> rgb = color_frame(request);
        if (first.empty()) first = rgb;
        EXPECT_TRUE(rgb == first) << format << " of " << request.device << ", buffers "
                                  << static_cast<int>(request.buffers);
      }
    for (std::size_t bar = 0; bar < kBars.size(); ++bar)
      for (std::size_t channel = 0; channel < 3; ++channel) {
        const int value = first[3 * (90 * 320 + 40 * bar + 20) + channel];
        EXPECT_LE(std::abs(value - kBars[bar][channel]), 6) << format << ", bar " << bar << ", channel " << channel;
      }
  }
}

TEST_F(Vivid, DmabufWithoutAnExporterTakesTheKernelsOrSaysThatItHasNone) {
  V4l2Request request = small_request(single[0], "Y16");
  request.buffers = Buffers::dmabuf;
  const bool has_udmabuf = ::access("/dev/udmabuf", R_OK | W_OK) == 0;
  const bool has_heap = ::access("/dev/dma_heap/system", R_OK | W_OK) == 0;
  if (!has_udmabuf && !has_heap) {
    EXPECT_EQ(depth_refusal(request),
              "this kernel has neither /dev/udmabuf nor /dev/dma_heap/system, or gives no permission; name a second camera "
              "as the exporter of the buffers, or use mmap");
    return;
  }
  const std::vector<std::uint16_t> expected = depth_frame(small_request(single[0], "Y16"));
  EXPECT_TRUE(depth_frame(request) == expected);
  for (const auto& [has, exporter] : {std::pair{has_udmabuf, "/dev/udmabuf"}, std::pair{has_heap, "/dev/dma_heap/system"}}) {
    if (!has) continue;
    request.dmabuf_exporter = exporter;
    EXPECT_TRUE(depth_frame(request) == expected) << exporter;
  }
}

TEST_F(Vivid, DmabufFromWhatExportsNothingIsASentence) {
  V4l2Request request = small_request(single[0], "Y16");
  request.buffers = Buffers::dmabuf;
  request.dmabuf_exporter = "/dev/null";
  EXPECT_EQ(depth_refusal(request), "/dev/null exports no buffers (VIDIOC_QUERYCAP: Inappropriate ioctl for device); name "
                                    "another exporter, or use mmap buffers");
}

TEST_F(Vivid, ImpossibleModesAreAnsweredWithWhatThereIs) {
  const std::string name = single[0].path + " (vivid)";
  V4l2Request request = small_request(single[0]);
  request.mode = {640, 480, 400};
  const std::string rate = depth_refusal(request);  // up to 25 Hz by Linux 6.1, to 60 Hz by 6.12
  EXPECT_TRUE(rate.starts_with(name + " does not offer depth at 400 Hz; it has Y16 640x480 at 1, 2, 4, 5, 10, 12.5, 15, 25"))
      << rate;
  request.mode = {641, 480, 0};
  EXPECT_EQ(depth_refusal(request),
            name + " does not offer depth at 641x480; it has Y16 at 320x180, 640x360, 640x480, 1280x720, 1920x1080 and "
                   "3840x2160 and Y12 at 320x180, 640x360, 640x480, 1280x720, 1920x1080 and 3840x2160");
  request.mode = {};
  request.format = "Z16";
  EXPECT_EQ(depth_refusal(request), name + " does not offer Z16; as depth it has Y16 and Y12");
  request.format = "GREY";
  EXPECT_EQ(depth_refusal(request),
            "the format GREY cannot be read as depth; use Z16, Y16 and Y12, or leave it to the device");
}

TEST_F(Vivid, RateIsSetAndMeasured) {
  for (const double rate_hz : {10.0, 25.0}) {
    V4l2Request request = small_request(single[0], "Y12");
    request.mode.frame_rate_hz = rate_hz;
    auto camera = depth(request);
    EXPECT_NEAR(camera.frame_rate_hz, rate_hz, 1e-9);
    std::vector<std::uint16_t> pixels(kPixels);
    FrameHeader first, last;
    ASSERT_EQ(camera.camera->read(pixels, first, kPatience), rt::Status::ok);
    for (int i = 0; i < 10; ++i) ASSERT_EQ(camera.camera->read(pixels, last, kPatience), rt::Status::ok);
    const double frames = static_cast<double>(last.sequence - first.sequence);
    EXPECT_NEAR((last.time - first.time).seconds() / frames, 1 / rate_hz, 0.3 / rate_hz)
        << "by the driver's own stamps and numbers, which tell 10 Hz from 25 Hz on any machine";
  }
}

TEST_F(Vivid, NodeWithoutWishesGivesVgaDepth) {
  V4l2Request request;
  request.device = single[0].path;
  auto camera = depth(request);
  EXPECT_EQ(camera.width, 640);
  EXPECT_EQ(camera.height, 480);
  const bool is_30_hz = camera.frame_rate_hz == 30;  // Linux 6.1 has 25 Hz at most
  EXPECT_NEAR(camera.frame_rate_hz, is_30_hz ? 30 : 25, 1e-9);
  EXPECT_EQ(camera.description, "V4L2 " + single[0].path + ": vivid (vivid, " + single[0].info.bus_info.data() +
                                    "), Y16 640x480 " + (is_30_hz ? "30" : "25") + " Hz, 4 mmap buffers");
}

TEST_F(Vivid, TimesRiseOnTheMonotonicClockAndSayWhatTheyAre) {
  for (const bool is_start : {false, true}) {
    set(single[0], "timestamp_source", is_start ? "Start of Exposure" : "End of Frame");
    auto camera = depth(small_request(single[0]));
    EXPECT_TRUE(camera.has_host_clock);
    ASSERT_FALSE(camera.notes.empty());
    EXPECT_NE(camera.notes.back().find(is_start ? "start of each exposure" : "end of each frame"), std::string::npos)
        << camera.notes.back();
    std::vector<std::uint16_t> pixels(kPixels);
    FrameHeader before;
    for (int i = 0; i < 10; ++i) {
      FrameHeader header;
      ASSERT_EQ(camera.camera->read(pixels, header, kPatience), rt::Status::ok);
      const std::int64_t now_ns = rt::Clock::monotonic().now().ns;
      EXPECT_GT(header.time, before.time);
      EXPECT_LE(header.arrived.ns, now_ns);
      // vivid works the end of a frame out by its rate, and gives the frame before it.
      EXPECT_LE(header.time.ns, header.arrived.ns + (is_start ? 0 : 34'000'000));
      EXPECT_GT(header.time.ns, now_ns - kPatience.ns) << "of this clock";
      before = header;
    }
  }
}

TEST_F(Vivid, DepthAndColourKeepTheRulesOfEveryCamera) {
  {
    auto camera = depth(small_request(single[0]));
    conformance::expect_live_rules(*camera.camera, camera.width, camera.height, 20);
  }
  V4l2Request request = small_request(single[0]);
  request.format = "YUYV";
  auto camera = color(request);
  conformance::expect_live_rules(*camera.camera, camera.width, camera.height, 20);
}

TEST_F(Vivid, TwoNodesShareOneClock) {
  const FoundNode other = single.size() > 1 ? single[1] : multi.empty() ? single[0] : multi[0];
  if (other.path == single[0].path) GTEST_SKIP() << "one vivid device only; load it with n_devs=2";
  auto deep = depth(small_request(single[0]));
  auto coloured = color(small_request(other));
  std::vector<std::uint16_t> pixels(kPixels);
  std::vector<std::uint8_t> rgb(3 * kPixels);
  std::vector<std::int64_t> depth_times, color_times;
  FrameHeader header;
  for (int i = 0; i < 20; ++i) {
    ASSERT_EQ(deep.camera->read(pixels, header, kPatience), rt::Status::ok);
    depth_times.push_back(header.time.ns);
    ASSERT_EQ(coloured.camera->read(rgb, header, kPatience), rt::Status::ok);
    color_times.push_back(header.time.ns);
  }
  int pairs_count = 0;
  for (const std::int64_t d : depth_times)
    pairs_count += std::any_of(color_times.begin(), color_times.end(),
                               [&](std::int64_t c) { return std::abs(c - d) <= 20'000'000; });
  EXPECT_GE(pairs_count, 5) << "of 20 within 20 ms; a busy machine leaves frames out";
}

TEST_F(Vivid, ControlsAreSetByNameOrRefusedWithTheirRange) {
  V4l2Request request = small_request(single[0]);
  request.controls = {{"brightness", "77"}, {"gain_automatic", "off"}, {"Gain", "37"}, {"test_pattern", "Gray Ramp"}};
  { EXPECT_GT(depth(request).width, 0); }
  EXPECT_EQ(get(single[0], "brightness"), 77);
  EXPECT_EQ(get(single[0], "gain"), 37);
  EXPECT_EQ(get(single[0], "test_pattern"), 20);
  set(single[0], "test_pattern", "0");
  set(single[0], "gain_automatic", "1");

  const std::string name = single[0].path + " (vivid)";
  request.controls = {{"brightness", "300"}};
  EXPECT_EQ(depth_refusal(request), name + " has brightness asked for as 300; it takes 0 to 255");
  request.controls = {{"gain", "5"}};
  EXPECT_EQ(depth_refusal(request),
            name + " sets gain by itself at present; switch its automatic off by a control before it");
  request.controls = {{"exposure", "5"}};
  EXPECT_TRUE(depth_refusal(request).starts_with(name + " has no control exposure; it has brightness, contrast, "));
}

TEST_F(Vivid, NodesThatCaptureNoImagesAreRefused) {
  for (const FoundNode& node : nodes_of("vivid")) {
    if (node.info.is_capture()) continue;
    EXPECT_TRUE(depth_refusal(small_request(node)).starts_with(node.path + " (vivid) captures no images")) << node.path;
  }
}

TEST_F(Vivid, NodeInUseIsASentence) {
  auto first = depth(small_request(single[0]));
  EXPECT_EQ(depth_refusal(small_request(single[0])),
            single[0].path + " (vivid) is in use by another program; close it first");
}

TEST_F(Vivid, ListNamesCaptureNodesWithTheirReadableModes) {
  const DeviceList list = list_devices();
  EXPECT_TRUE(list.why_none.empty());
  std::size_t vivids_count = 0;
  for (const DeviceEntry& entry : list.devices) {
    if (entry.name.find("vivid") == std::string::npos) continue;
    ++vivids_count;
    EXPECT_EQ(entry.trouble, "");
    EXPECT_EQ(std::count_if(entry.formats.begin(), entry.formats.end(),
                            [](const std::string& line) {
                              return line.starts_with("depth Y16 640x480 1, 2, 4, 5, 10, 12.5, 15, 25");
                            }),
              1);
    EXPECT_TRUE(entry.formats.back().starts_with("not readable: UYVY")) << entry.formats.back();
  }
  EXPECT_EQ(vivids_count, single.size() + multi.size());
}

TEST_F(Vivid, UserWithoutPermissionIsToldTheGroup) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root can become somebody else";
  constexpr uid_t kNobody = 65534;
  ASSERT_EQ(::seteuid(kNobody), 0);
  const std::string refused = depth_refusal(small_request(single[0]));
  const DeviceList list = list_devices();
  ASSERT_EQ(::seteuid(0), 0);
  const std::string sentence = "no permission to open " + single[0].path + "; join the group video (sudo usermod -aG video ";
  if (refused.starts_with("opened")) GTEST_SKIP() << "everybody may open cameras here";
  EXPECT_TRUE(refused.starts_with(sentence)) << refused;
  ASSERT_FALSE(list.devices.empty());
  EXPECT_TRUE(list.devices[0].trouble.starts_with("no permission to open ")) << list.devices[0].trouble;
}

/// Keeps what it is shown.
class Witness final : public FrameTap {
 public:
  void take(Stream stream, const RawFrame& frame) noexcept override {
    if (count < sequences.size()) sequences[count++] = frame.header.sequence;
    is_right = is_right && stream == Stream::color && frame.format == PixelFormat::yuyv && frames::is_whole(frame);
  }
  std::array<std::uint64_t, 64> sequences{};
  std::size_t count = 0;
  bool is_right = true;
};

TEST_F(Vivid, PeekHoldsSkipPassesOverAndTheTapSeesEachOnce) {
  auto coloured = color(small_request(single[0], "YUYV"));
  Witness witness;
  coloured.camera->set_tap(&witness);
  std::vector<std::uint8_t> rgb(3 * kPixels);
  std::vector<std::uint64_t> sequences;
  for (int i = 0; i < 12; ++i) {
    FrameHeader announced, again, header;
    ASSERT_EQ(coloured.camera->peek(announced, kPatience), rt::Status::ok);
    ASSERT_EQ(coloured.camera->peek(again, {}), rt::Status::ok);
    EXPECT_EQ(again.sequence, announced.sequence);
    sequences.push_back(announced.sequence);
    if (i % 3 == 2) {
      coloured.camera->skip();
      continue;
    }
    ASSERT_EQ(coloured.camera->read(rgb, header, kPatience), rt::Status::ok);
    EXPECT_EQ(header.sequence, announced.sequence);
    EXPECT_EQ(header.time, announced.time);
  }
  EXPECT_TRUE(witness.is_right);
  EXPECT_EQ(std::vector(witness.sequences.begin(), witness.sequences.begin() + static_cast<std::ptrdiff_t>(witness.count)),
            sequences);
  EXPECT_EQ(coloured.camera->counters().frames_delivered, 12U);
}

TEST_F(Vivid, ImpatientReaderIsToldAndLosesNothing) {
  V4l2Request request = small_request(single[0]);
  request.mode.frame_rate_hz = 10;
  auto camera = depth(request);
  std::vector<std::uint16_t> pixels(kPixels);
  FrameHeader header;
  ASSERT_EQ(camera.camera->read(pixels, header, kPatience), rt::Status::ok);
  const std::uint64_t first = header.sequence;
  int timeouts_count = 0;
  for (int frames = 0; frames < 5;) {
    const rt::Status status = camera.camera->read(pixels, header, rt::Duration{1'000'000});
    ASSERT_TRUE(status == rt::Status::ok || status == rt::Status::timeout);
    frames += status == rt::Status::ok ? 1 : 0;
    timeouts_count += status == rt::Status::timeout ? 1 : 0;
  }
  EXPECT_GT(timeouts_count, 0);
  EXPECT_EQ(header.sequence - first, 5 + camera.camera->counters().frames_missing);
}

TEST_F(Vivid, ReadingMakesNoHeapCall) {
  if (!rt::heap_guard::is_active()) GTEST_SKIP() << "this build does not count heap calls";
  std::vector<std::uint16_t> pixels(kPixels);
  std::vector<std::uint8_t> rgb(3 * kPixels);
  const FoundNode exporter = single.size() > 1 ? single[1] : multi.empty() ? single[0] : multi[0];
  for (V4l2Request request : every_kind(single[0], {exporter}, "")) {
    const std::uint64_t before = rt::heap_guard::was_total_calls();
    int good_count = 0;
    for (const bool is_depth : {true, false}) {
      request.format = is_depth ? "Y16" : "NV12";
      auto deep = is_depth ? depth(request) : LiveCamera<DepthCamera>{};
      auto coloured = is_depth ? LiveCamera<ColorCamera>{} : color(request);
      rt::heap_guard::seal();
      {
        const rt::RtScope scope;
        FrameHeader header;
        for (int i = 0; i < 10; ++i) {
          if (is_depth) {
            good_count += deep.camera->read(pixels, header, kPatience) == rt::Status::ok ? 1 : 0;
          } else if (coloured.camera->peek(header, kPatience) == rt::Status::ok) {
            ++good_count;
            if (i % 2 == 0)
              coloured.camera->skip();
            else
              (void)coloured.camera->read(rgb, header, kPatience);
          }
        }
      }
      rt::heap_guard::unseal();
    }
    EXPECT_EQ(good_count, 20);
    EXPECT_EQ(rt::heap_guard::was_total_calls() - before, 0U) << "buffers " << static_cast<int>(request.buffers);
  }
}

}  // namespace
}  // namespace tactus::hal::v4l2
