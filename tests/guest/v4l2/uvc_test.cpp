// USB cameras behind the kernel's uvcvideo: depth in Z16, and the begin of exposure by their metadata.
#include <gtest/gtest.h>

#include <vector>

#include "hal/v4l2/uvc_metadata.hpp"
#include "hal/v4l2/v4l2.hpp"
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
    EXPECT_GT(header.sequence, before.sequence);
    EXPECT_GT(header.time, before.time);
    EXPECT_LE(header.time.ns, header.arrived.ns);
    EXPECT_GT(header.time.ns, header.arrived.ns - 1'000'000'000);
    before = header;
  }
  EXPECT_GT(camera->camera->counters().frames_delivered, 4U);
}

/// The metadata node itself: each frame has its begin.
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
