#include "hal/libcamera/present/controls.hpp"

#include <gtest/gtest.h>

namespace tactus::hal::libcamera {
namespace {

const lc::ControlInfo kGain(1.0F, 16.0F, 1.0F);
const lc::ControlInfo kExposure(std::int32_t{100}, std::int32_t{200000}, std::int32_t{3000});

lc::ControlInfoMap offered() {
  return lc::ControlInfoMap({{&lc::controls::AnalogueGain, kGain},
                             {&lc::controls::ExposureTime, kExposure},
                             {&lc::controls::AeEnable, lc::ControlInfo(false, true, true)}},
                            lc::controls::controls);
}

TEST(LibcameraControls, ValueTakesTheTypeOfItsControl) {
  const auto gain = parse_control(lc::controls::AnalogueGain, kGain, "2.5");
  ASSERT_TRUE(gain) << gain.error().message;
  EXPECT_EQ(gain->get<float>(), 2.5F);
  const auto exposure = parse_control(lc::controls::ExposureTime, kExposure, "10000");
  ASSERT_TRUE(exposure) << exposure.error().message;
  EXPECT_EQ(exposure->get<std::int32_t>(), 10000);
  const auto automatic = parse_control(lc::controls::AeEnable, lc::ControlInfo(), "false");
  ASSERT_TRUE(automatic) << automatic.error().message;
  EXPECT_FALSE(automatic->get<bool>());
  const auto gains = parse_control(lc::controls::ColourGains, lc::ControlInfo(0.0F, 32.0F), "1.5,2");
  ASSERT_TRUE(gains) << gains.error().message;
  EXPECT_EQ((gains->get<lc::Span<const float>>()[1]), 2.0F);
}

TEST(LibcameraControls, ValueOutOfRangeIsRefusedWithTheRange) {
  for (const char* text : {"0.5", "16.5", "-1"}) {
    const auto refused = parse_control(lc::controls::AnalogueGain, kGain, text);
    ASSERT_FALSE(refused) << text;
    EXPECT_EQ(refused.error().code, rt::ExitCode::bad_usage);
    EXPECT_NE(refused.error().message.find("1.000000 to 16.000000"), std::string::npos) << refused.error().message;
  }
  EXPECT_FALSE(parse_control(lc::controls::ExposureTime, kExposure, "99"));
  EXPECT_TRUE(parse_control(lc::controls::ExposureTime, kExposure, "100"));
  EXPECT_TRUE(parse_control(lc::controls::ExposureTime, kExposure, "200000"));
}

TEST(LibcameraControls, WhatIsNoNumberOrOneTooManyIsRefused) {
  for (const char* text : {"", "x", "1.5x", "nan", "inf", "2,2", "2,", " 2", "1e99"})
    EXPECT_FALSE(parse_control(lc::controls::AnalogueGain, kGain, text)) << text;
  for (const char* text : {"1.5", "99999999999", "0x10"})
    EXPECT_FALSE(parse_control(lc::controls::ExposureTime, kExposure, text)) << text;
  for (const char* text : {"yes", "", "2"})
    EXPECT_FALSE(parse_control(lc::controls::AeEnable, lc::ControlInfo(), text)) << text;
  for (const char* text : {"1", "1,2,3"})
    EXPECT_FALSE(parse_control(lc::controls::ColourGains, lc::ControlInfo(0.0F, 32.0F), text)) << text;
  EXPECT_FALSE(parse_control(lc::controls::ScalerCrop, lc::ControlInfo(), "0,0,640,480"));
}

TEST(LibcameraControls, NamesAreLookedUpAmongWhatTheCameraHas) {
  const std::vector<std::pair<std::string, std::string>> wanted{{"AeEnable", "false"}, {"ExposureTime", "5000"}};
  const auto settings = parse_controls(offered(), wanted);
  ASSERT_TRUE(settings) << settings.error().message;
  ASSERT_EQ(settings->size(), 2U);
  EXPECT_EQ((*settings)[1].id, lc::controls::ExposureTime.id());
  EXPECT_EQ((*settings)[1].value.get<std::int32_t>(), 5000);
}

TEST(LibcameraControls, UnknownNameIsRefusedWithTheNamesThereAre) {
  const std::vector<std::pair<std::string, std::string>> wanted{{"Exposure", "5000"}};
  const auto refused = parse_controls(offered(), wanted);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, rt::ExitCode::bad_usage);
  EXPECT_NE(refused.error().message.find("AeEnable"), std::string::npos) << refused.error().message;
  EXPECT_NE(refused.error().message.find("ExposureTime [100..200000]"), std::string::npos) << refused.error().message;
}

}  // namespace
}  // namespace tactus::hal::libcamera
