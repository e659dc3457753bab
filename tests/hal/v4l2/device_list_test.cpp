#include <gtest/gtest.h>

#include <cerrno>
#include <filesystem>

#include "hal/v4l2/node.hpp"
#include "hal/v4l2/v4l2.hpp"

namespace tactus::hal::v4l2 {
namespace {

TEST(V4l2DeviceList, MachineWithoutNodesSaysSo) {
  for (const auto& entry : std::filesystem::directory_iterator("/dev"))
    if (entry.path().filename().string().starts_with("video")) GTEST_SKIP() << "this machine has " << entry.path();
  const DeviceList list = list_devices();
  EXPECT_EQ(list.backend, "V4L2");
  EXPECT_TRUE(list.devices.empty());
  EXPECT_EQ(list.why_none,
            "there is no /dev/video node: no camera is plugged in, or its driver is not loaded (dmesg tells)");
}

TEST(V4l2DeviceList, EveryEntryCanBeOpenedOrSaysWhyNot) {
  const DeviceList list = list_devices();
  EXPECT_EQ(list.devices.empty(), !list.why_none.empty());
  for (const DeviceEntry& entry : list.devices) {
    EXPECT_TRUE(entry.source.starts_with("v4l2:/dev/video")) << entry.source;
    EXPECT_EQ(entry.formats.empty(), !entry.trouble.empty()) << entry.source;
  }
}

TEST(V4l2Open, NodeThatIsNotThereIsASentence) {
  V4l2Request request;
  request.device = "/dev/video255";
  const auto depth = open_depth(request);
  ASSERT_FALSE(depth);
  EXPECT_EQ(depth.error().code, rt::ExitCode::device_unavailable);
  EXPECT_EQ(depth.error().message, "/dev/video255 does not exist; tactus devices lists the cameras that are plugged in");
}

TEST(V4l2Open, OtherFilesAreNoCameras) {
  V4l2Request request;
  request.device = "/dev/null";
  const auto color = open_color(request);
  ASSERT_FALSE(color);
  EXPECT_EQ(color.error().message, "/dev/null is no V4L2 device; tactus devices lists those there are");
}

TEST(V4l2Open, MissingPermissionNamesAGroup) {
  EXPECT_EQ(open_trouble("/nowhere/video0", EACCES),
            "no permission to open /nowhere/video0; join the group video (sudo usermod -aG video $USER) and log in again");
}

}  // namespace
}  // namespace tactus::hal::v4l2
