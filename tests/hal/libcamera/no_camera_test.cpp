#include <gtest/gtest.h>

#include "hal/libcamera/libcamera.hpp"
#include "hal/libcamera/present/manager.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tactus::hal::libcamera {
namespace {

const auto kMayOpen = [](const std::filesystem::path&) { return true; };

TEST(NoLibcameraCamera, SentenceTellsNoDeviceNoPermissionAndNoPipelineApart) {
  const test::TemporaryFolder dev;
  EXPECT_NE(explain_no_camera(dev.path(), kMayOpen).find("no camera is plugged in"), std::string::npos);
  EXPECT_NE(explain_no_camera(dev.path() / "nowhere", kMayOpen).find("no camera is plugged in"), std::string::npos);
  dev.write("media0", "");
  dev.write("media1", "");
  dev.write("video0", "");
  EXPECT_NE(explain_no_camera(dev.path(), kMayOpen).find("no pipeline"), std::string::npos);
  const std::string forbidden =
      explain_no_camera(dev.path(), [](const std::filesystem::path& file) { return file.filename() != "media1"; });
  EXPECT_NE(forbidden.find("No permission to open " + (dev.path() / "media1").string()), std::string::npos) << forbidden;
  EXPECT_NE(forbidden.find("group video"), std::string::npos) << forbidden;
}

/// With the library's own manager; where a camera is plugged in, there is nothing of this to see.
class WithoutCamera : public testing::Test {
 protected:
  void SetUp() override {
    if (!list_devices().devices.empty()) GTEST_SKIP() << "libcamera sees a camera on this machine";
  }
};

TEST_F(WithoutCamera, DevicesAreNoneAndTheSentenceSaysWhy) {
  const DeviceList list = list_devices();
  EXPECT_EQ(list.backend, "libcamera");
  EXPECT_FALSE(list.why_none.empty());
  EXPECT_EQ(list.why_none.find("Not built"), std::string::npos);
}

TEST_F(WithoutCamera, OpeningIsRefusedEachTimeWithTheSameSentence) {
  for (const char* id : {"", "usb"}) {
    const auto refused = open_color({.id = id, .mode = {}, .format = "", .controls = {}});
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, rt::ExitCode::device_unavailable);
    EXPECT_NE(refused.error().message.find(list_devices().why_none), std::string::npos) << refused.error().message;
  }
}

TEST(LibcameraManager, SecondUserSharesItAndANewOneStartsAfterTheLastHasGone) {
  for (int round = 0; round < 3; ++round) {
    auto first = camera_manager();
    ASSERT_TRUE(first) << first.error().message;
    auto second = camera_manager();
    ASSERT_TRUE(second) << second.error().message;
    EXPECT_EQ(first->get(), second->get());
    first->reset();
    EXPECT_EQ((*second)->cameras().size(), list_devices().devices.size());
  }
}

}  // namespace
}  // namespace tactus::hal::libcamera
