// A renderer on an offscreen display with its planned memory, for tests.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <memory>
#include <optional>
#include <vector>

#include "hal/egl/offscreen.hpp"
#include "pipeline/render/renderer.hpp"

namespace tactus::test {

inline hal::Intrinsics pinhole(int width, int height, double f) {
  hal::Intrinsics camera;
  camera.width = width;
  camera.height = height;
  camera.fx = f;
  camera.fy = f;
  camera.cx = (width - 1) / 2.0;
  camera.cy = (height - 1) / 2.0;
  return camera;
}

/// Holds all that one renderer needs. Members in order: the renderer's GL objects go before their context.
struct Drawing {
  explicit Drawing(hal::egl::OffscreenDisplay&& opened, const render::RenderConfig& render_config)
      : config(render_config),
        display(std::move(opened)),
        bytes_count(render::Renderer::bytes_needed(config)),
        memory(static_cast<std::byte*>(std::aligned_alloc(rt::kCacheLineBytes, bytes_count)), std::free) {}

  rt::Slice slice() { return rt::Slice({memory.get(), bytes_count}); }

  render::RenderConfig config;
  hal::egl::OffscreenDisplay display;
  std::size_t bytes_count;
  std::unique_ptr<std::byte, decltype(&std::free)> memory;
  render::Renderer renderer;
};

/// Skips the test when this machine has no EGL; fails it when the renderer does not start.
class DrawingTest : public testing::Test {
 protected:
  void open(const render::RenderConfig& config) {
    auto display = hal::egl::OffscreenDisplay::create({config.camera.width, config.camera.height});
    if (!display && display.error().code == rt::ExitCode::device_unavailable)
      GTEST_SKIP() << display.error().message;
    ASSERT_TRUE(display) << display.error().message;
    drawing_ = std::make_unique<Drawing>(std::move(*display), config);
    ASSERT_EQ(drawing_->display.begin(), rt::Status::ok);
    const auto bound = drawing_->renderer.bind(config, drawing_->slice());
    ASSERT_TRUE(bound) << bound.error().message;
    const auto warm = drawing_->renderer.warm_up();
    ASSERT_TRUE(warm) << warm.error().message;
  }

  rt::Status draw(const render::RenderInputs& inputs, std::span<std::uint8_t> rgb) {
    EXPECT_EQ(drawing_->display.begin(), rt::Status::ok);
    const rt::Status status = drawing_->renderer.step(inputs);
    EXPECT_EQ(drawing_->renderer.read_back(rgb), rt::Status::ok);
    EXPECT_EQ(drawing_->display.present(), rt::Status::ok);
    return status;
  }

  std::unique_ptr<Drawing> drawing_;
};

}  // namespace tactus::test
