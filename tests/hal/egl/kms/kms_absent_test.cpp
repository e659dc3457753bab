#include <gtest/gtest.h>

#include "hal/egl/kms_display.hpp"

namespace tactus::hal::egl {
namespace {

TEST(KmsDisplayWithoutLibdrm, CreateSaysSoInOneSentence) {
  const auto refused = KmsDisplay::create({640, 480});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, rt::ExitCode::device_unavailable);
  EXPECT_NE(refused.error().message.find("without libdrm"), std::string::npos);
}

}  // namespace
}  // namespace tactus::hal::egl
