#include <gtest/gtest.h>

#include "hal/libcamera/libcamera.hpp"

namespace tactus::hal::libcamera {
namespace {

TEST(WithoutLibcamera, OpeningSaysNotBuiltInOneSentence) {
  const auto refused = open_color({});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, rt::ExitCode::device_unavailable);
  EXPECT_NE(refused.error().message.find("built without libcamera"), std::string::npos);
}

TEST(WithoutLibcamera, DevicesAreNoneAndTheSentenceSaysWhy) {
  const DeviceList list = list_devices();
  EXPECT_EQ(list.backend, "libcamera");
  EXPECT_TRUE(list.devices.empty());
  EXPECT_TRUE(list.why_none.starts_with("Not built: ")) << list.why_none;
}

}  // namespace
}  // namespace tactus::hal::libcamera
