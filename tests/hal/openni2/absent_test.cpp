#include <gtest/gtest.h>

#include "hal/openni2/openni2.hpp"

namespace tactus::hal::openni2 {
namespace {

TEST(WithoutOpenNi2, EveryWayInSaysSoInOneSentence) {
  const auto device = open_openni2({});
  const auto file = open_oni("room.oni", {});
  ASSERT_FALSE(device);
  ASSERT_FALSE(file);
  for (const rt::Error& error : {device.error(), file.error()}) {
    EXPECT_EQ(error.code, rt::ExitCode::device_unavailable);
    EXPECT_NE(error.message.find("without OpenNI2"), std::string::npos) << error.message;
  }
  EXPECT_EQ(file.error().message.find("room.oni"), 0U);
  const DeviceList list = list_devices();
  EXPECT_TRUE(list.devices.empty());
  EXPECT_NE(list.why_none.find("without OpenNI2"), std::string::npos);
}

}  // namespace
}  // namespace tactus::hal::openni2
