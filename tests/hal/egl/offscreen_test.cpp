#include "hal/egl/offscreen.hpp"

#include <GLES3/gl3.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <optional>
#include <thread>

namespace tactus::hal::egl {
namespace {

class OffscreenDisplayTest : public testing::Test {
 protected:
  void SetUp() override {
    auto created = OffscreenDisplay::create({64, 48});
    if (!created && created.error().code == rt::ExitCode::device_unavailable)
      GTEST_SKIP() << created.error().message;
    ASSERT_TRUE(created) << created.error().message;
    sut_.emplace(std::move(*created));
  }

  static std::array<std::uint8_t, 4> pixel_at(int x, int y) {
    std::array<std::uint8_t, 4> rgba{};
    glReadPixels(x, y, 1, 1, GL_RGBA, GL_UNSIGNED_BYTE, rgba.data());
    return rgba;
  }

  std::optional<OffscreenDisplay> sut_;
};

TEST_F(OffscreenDisplayTest, WhatIsDrawnIsThereAfterPresent) {
  ASSERT_EQ(sut_->begin(), rt::Status::ok);
  glClearColor(1.0F, 0.0F, 0.2F, 1.0F);
  glClear(GL_COLOR_BUFFER_BIT);
  ASSERT_EQ(sut_->present(), rt::Status::ok);
  EXPECT_EQ(pixel_at(63, 47), (std::array<std::uint8_t, 4>{255, 0, 51, 255}));
  EXPECT_EQ(sut_->frames_presented(), 1U);
  EXPECT_EQ(glGetError(), static_cast<GLenum>(GL_NO_ERROR));
}

TEST_F(OffscreenDisplayTest, DepthBufferHasAtLeast24Bits) {
  ASSERT_EQ(sut_->begin(), rt::Status::ok);
  GLint bits = 0;
  glGetFramebufferAttachmentParameteriv(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT,
                                        GL_FRAMEBUFFER_ATTACHMENT_DEPTH_SIZE, &bits);
  EXPECT_GE(bits, 24);
}

TEST_F(OffscreenDisplayTest, DescriptionNamesRendererAndVersion) {
  ASSERT_EQ(sut_->begin(), rt::Status::ok);
  EXPECT_NE(sut_->context().description().find("OpenGL ES 3"), std::string::npos)
      << sut_->context().description();
}

TEST_F(OffscreenDisplayTest, AnotherThreadDrawsOnlyAfterRelease) {
  ASSERT_EQ(sut_->begin(), rt::Status::ok);
  rt::Status while_held = rt::Status::ok, when_released = rt::Status::device_lost;
  std::thread([&] { while_held = sut_->begin(); }).join();
  sut_->release();
  std::thread([&] {
    when_released = sut_->begin();
    sut_->release();
  }).join();
  EXPECT_EQ(while_held, rt::Status::device_lost);
  EXPECT_EQ(when_released, rt::Status::ok);
}

TEST_F(OffscreenDisplayTest, TwoDisplaysDoNotDisturbEachOther) {
  {
    auto other = OffscreenDisplay::create({16, 16});
    ASSERT_TRUE(other) << other.error().message;
    ASSERT_EQ(other->begin(), rt::Status::ok);
    glClearColor(0, 1, 0, 1);
    glClear(GL_COLOR_BUFFER_BIT);
  }
  ASSERT_EQ(sut_->begin(), rt::Status::ok);
  glClearColor(0, 0, 1, 1);
  glClear(GL_COLOR_BUFFER_BIT);
  EXPECT_EQ(pixel_at(0, 0), (std::array<std::uint8_t, 4>{0, 0, 255, 255}));
}

TEST_F(OffscreenDisplayTest, SizesThatCannotBeDrawnAreRefusedWithOneSentence) {
  for (const DisplayFormat format :
       {DisplayFormat{0, 48}, DisplayFormat{64, -1}, DisplayFormat{1 << 20, 48}}) {
    const auto refused = OffscreenDisplay::create(format);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, rt::ExitCode::bad_usage);
    EXPECT_NE(refused.error().message.find(std::to_string(format.width_px) + " x "), std::string::npos);
  }
}

}  // namespace
}  // namespace tactus::hal::egl
