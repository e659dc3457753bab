// What showing a picture costs on a software X server.
#include <GLES3/gl3.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <ctime>

#include "hal/egl/x11_window.hpp"
#include "tests/hal/egl/x_server.hpp"

namespace tactus::hal::egl {
namespace {

TEST(WindowDisplayLatency, PresentOf640x480) {
  const auto server = test::XServer::start();
  if (!server) GTEST_SKIP() << "Xvfb is not here or does not start; install xvfb";
  setenv("DISPLAY", server->name().c_str(), 1);
  auto sut = WindowDisplay::create({640, 480});
  if (!sut) GTEST_SKIP() << sut.error().message;
  test::Person person(*server);
  constexpr int kPicturesCount = 100;
  for (const auto [width_px, height_px] : {std::array{640U, 480U}, std::array{800U, 600U}}) {
    person.resize_window(width_px, height_px);
    const std::clock_t before = std::clock();
    for (int i = 0; i < kPicturesCount; ++i) {
      ASSERT_EQ(sut->begin(), rt::Status::ok);
      ASSERT_EQ(sut->present(), rt::Status::ok);
    }
    std::printf("640 x 480 in a window of %u x %u, %s: %.2f ms of processor time a picture\n", width_px,
                height_px, sut->context().description().c_str(),
                1e3 * static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC / kPicturesCount);
  }
}

}  // namespace
}  // namespace tactus::hal::egl
