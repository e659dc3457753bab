// USB cameras behind the kernel's uvcvideo: depth in Z16, and the begin of exposure by their metadata.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <vector>

#include "hal/v4l2/uvc_metadata.hpp"
#include "hal/v4l2/v4l2.hpp"
#include "rt/heap_guard.hpp"
#include "tests/conformance/live_rules.hpp"
#include "tests/guest/v4l2/nodes.hpp"

namespace tactus::hal::v4l2 {
namespace {

constexpr rt::Duration kPatience{20'000'000'000};

TEST(Uvc, DepthComesInZ16WithTimesFromTheCamerasMetadata) {
  const std::vector<FoundNode> nodes = capture_nodes_of("uvcvideo", false);
  if (nodes.empty()) GTEST_SKIP() << "this machine has no uvcvideo camera";
  V4l2Request request;
  request.device = nodes[0].path;
  request.format = "Z16";
  auto camera = open_depth(request);
  if (!camera) GTEST_SKIP() << camera.error().message;
  EXPECT_TRUE(camera->has_host_clock);
  EXPECT_NE(camera->notes.back().find("UVC metadata"), std::string::npos) << camera->notes.back();
  std::vector<std::uint16_t> pixels(static_cast<std::size_t>(camera->width) * static_cast<std::size_t>(camera->height));
  FrameHeader before;
  for (int i = 0; i < 10; ++i) {
    FrameHeader header;
    const rt::Status status = camera->camera->read(pixels, header, kPatience);
    if (status == rt::Status::corrupt) continue;
    ASSERT_EQ(status, rt::Status::ok);
    if (before.time.ns > 0) {
      EXPECT_GT(header.sequence, before.sequence);
      EXPECT_GT(header.time, before.time);
    }
    EXPECT_LE(header.time.ns, header.arrived.ns);
    EXPECT_GT(header.time.ns, header.arrived.ns - kPatience.ns) << "of this clock, however slow the machine";
    before = header;
  }
  EXPECT_GT(camera->camera->counters().frames_delivered, 4U);
}

TEST(Uvc, DepthAndColourKeepTheRulesOfEveryCamera) {
  const std::vector<FoundNode> nodes = capture_nodes_of("uvcvideo", false);
  if (nodes.empty()) GTEST_SKIP() << "this machine has no uvcvideo camera";
  int cameras_count = 0;
  for (const FoundNode& node : nodes) {
    V4l2Request request;
    request.device = node.path;
    if (auto camera = open_depth(request); camera) {
      conformance::expect_live_rules(*camera->camera, camera->width, camera->height, 12);
      ++cameras_count;
    } else if (auto color = open_color(request); color) {
      conformance::expect_live_rules(*color->camera, color->width, color->height, 12);
      ++cameras_count;
    }
  }
  EXPECT_GT(cameras_count, 0);
}

TEST(Uvc, ColourComesInEveryFormatOnOffer) {
  const std::vector<FoundNode> nodes = capture_nodes_of("uvcvideo", false);
  if (nodes.empty()) GTEST_SKIP() << "this machine has no uvcvideo camera";
  int formats_count = 0;
  for (const FoundNode& node : nodes)
    for (const std::string format : {"YUYV", "NV12", "MJPG"}) {
      V4l2Request request;
      request.device = node.path;
      request.format = format;
      auto camera = open_color(request);
      if (!camera) {
        EXPECT_NE(camera.error().message.find("does not offer " + format), std::string::npos) << camera.error().message;
        continue;
      }
      ++formats_count;
      std::vector<std::uint8_t> rgb(3 * static_cast<std::size_t>(camera->width) * static_cast<std::size_t>(camera->height));
      FrameHeader header;
      const std::uint64_t heap_before = rt::heap_guard::was_total_calls();
      rt::heap_guard::seal();
      {
        const rt::RtScope scope;
        for (int i = 0; i < 6; ++i) (void)camera->camera->read(rgb, header, kPatience);
      }
      rt::heap_guard::unseal();
      EXPECT_EQ(rt::heap_guard::was_total_calls() - heap_before, 0U) << format << ", libjpeg's own not counted";
      EXPECT_GE(camera->camera->counters().frames_delivered, 5U)
          << format << " of " << node.path << ": " << camera->camera->counters().first_rejection;
    }
  if (formats_count == 0) GTEST_SKIP() << "the uvcvideo cameras here give no colour";
}

/// The kernel takes the device away and gives it back as if its plug were pulled.
TEST(Uvc, UnpluggedCameraIsLostAtOnceAndComesBack) {
  const std::vector<FoundNode> nodes = capture_nodes_of("uvcvideo", false);
  if (nodes.empty()) GTEST_SKIP() << "this machine has no uvcvideo camera";
  const std::string name = std::filesystem::path(nodes[0].path).filename().string();
  const std::filesystem::path plug =
      std::filesystem::canonical("/sys/class/video4linux/" + name + "/device").parent_path() / "authorized";
  V4l2Request request;
  request.device = nodes[0].path;
  request.format = "Z16";
  auto camera = open_depth(request);
  if (!camera) GTEST_SKIP() << camera.error().message;
  std::vector<std::uint16_t> pixels(static_cast<std::size_t>(camera->width) * static_cast<std::size_t>(camera->height));
  FrameHeader before, header;
  ASSERT_EQ(camera->camera->read(pixels, before, kPatience), rt::Status::ok);

  std::ofstream(plug) << "0" << std::flush;
  const auto read = [&](rt::Duration timeout) {
    rt::heap_guard::seal();
    rt::Status status;
    {
      const rt::RtScope scope;
      status = camera->camera->read(pixels, header, timeout);
    }
    rt::heap_guard::unseal();
    return status;
  };
  const std::uint64_t heap_before = rt::heap_guard::was_total_calls();
  EXPECT_EQ(read(kPatience), rt::Status::device_lost);
  EXPECT_EQ(read(rt::Duration{1'000'000'000}), rt::Status::device_lost);
  EXPECT_EQ(camera->camera->counters().losses, 1U);

  std::ofstream(plug) << "1" << std::flush;
  rt::Status status = rt::Status::device_lost;
  for (int i = 0; i < 100 && status != rt::Status::ok; ++i) status = read(rt::Duration{500'000'000});
  ASSERT_EQ(status, rt::Status::ok);
  EXPECT_EQ(header.sequence, before.sequence + 1);
  EXPECT_GT(header.time, before.time);
  EXPECT_EQ(camera->camera->counters().losses, 1U);
  EXPECT_EQ(rt::heap_guard::was_total_calls() - heap_before, 0U);
}

TEST(Uvc, MetadataNodeIsFoundBesideTheImageNode) {
  const std::vector<FoundNode> nodes = capture_nodes_of("uvcvideo", false);
  if (nodes.empty()) GTEST_SKIP() << "this machine has no uvcvideo camera";
  int error = 0;
  const Descriptor node = open_node(nodes[0].path.c_str(), error);
  ASSERT_TRUE(node.is_open());
  UvcMetadata sut;
  EXPECT_TRUE(sut.start(node.get(), nodes[0].info));
  EXPECT_TRUE(sut.is_running());
  EXPECT_EQ(sut.capture_begin(0), std::nullopt) << "no image stream, no metadata";
}

}  // namespace
}  // namespace tactus::hal::v4l2
