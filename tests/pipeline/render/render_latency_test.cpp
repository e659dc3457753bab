// What drawing costs at 640 x 480; prints a table, fails only when the present thread could not keep 30
// pictures a second.
#include <gtest/gtest.h>
#include <time.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <vector>

#include "pipeline/render/resident.hpp"
#include "tests/pipeline/render/drawing.hpp"

namespace tactus::render {
namespace {

constexpr int kWidth = 640, kHeight = 480, kFramesCount = 200;

class RenderLatencyTest : public test::DrawingTest {
 protected:
  void SetUp() override {
    RenderConfig config;
    config.camera = test::pinhole(kWidth, kHeight, 525);
    const auto before = resident_bytes();
    open(config);
    if (drawing_ == nullptr) return;
    const auto after = resident_bytes();
    std::printf("%s; %zu bytes planned, %zu KB resident for the driver\n",
                drawing_->display.context().description().c_str(), drawing_->bytes_count,
                before && after ? (*after - *before) / 1024 : 0);
  }

  static double processor_ms() {
    timespec now{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) * 1e3 + static_cast<double>(now.tv_nsec) * 1e-6;
  }

  /// Median of the time on the clock, in milliseconds; each run ends with the picture finished. The processor
  /// time beside it (mean, all threads) means something on a busy machine, too.
  template <typename Work>
  double measure(const char* name, Work&& work) {
    std::vector<double> times_ms;
    const double processor_start_ms = processor_ms();
    for (int i = 0; i < kFramesCount; ++i) {
      const auto start = std::chrono::steady_clock::now();
      work();
      times_ms.push_back(
          std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
    }
    const double mean_processor_ms = (processor_ms() - processor_start_ms) / kFramesCount;
    std::sort(times_ms.begin(), times_ms.end());
    const auto at = [&](double part) {
      return times_ms[static_cast<std::size_t>(part * (kFramesCount - 1))];
    };
    std::printf("%-34s p50 %6.2f  p99 %6.2f  max %6.2f  processor %6.2f ms\n", name, at(0.5), at(0.99),
                times_ms.back(), mean_processor_ms);
    return at(0.5);
  }
};

TEST_F(RenderLatencyTest, PicturesOf640x480KeepUpWith30AThread) {
  std::vector<std::uint8_t> video(kWidth * kHeight * 3);
  for (std::size_t i = 0; i < video.size(); ++i) video[i] = static_cast<std::uint8_t>(i * 7);
  std::vector<float> depth_m(kWidth * kHeight);
  for (std::size_t i = 0; i < depth_m.size(); ++i) depth_m[i] = i % 640 < 320 ? 1.2F : 3.0F;
  std::vector<MaterialId> labels(kWidth * kHeight);
  for (std::size_t i = 0; i < labels.size(); ++i) labels[i] = static_cast<MaterialId>(i / 4096 % 23);
  std::vector<Body> bodies;
  for (int i = 0; i < 30; ++i)
    bodies.push_back({i % 2 == 0 ? Shape::sphere : Shape::box,
                      {200, 100, 50},
                      {0.08F, 0.08F, 0.08F},
                      {0.2 * (i % 6) - 0.5, 0.2 * (i / 6) - 0.4, 1.3 + 0.02 * i},
                      {0.8, 0.6, 0, 0}});
  std::vector<std::uint8_t> rgb(video.size());
  const auto step = [&](const RenderInputs& inputs) {
    ASSERT_EQ(drawing_->display.begin(), rt::Status::ok);
    ASSERT_EQ(drawing_->renderer.step(inputs), rt::Status::ok);
    ASSERT_EQ(drawing_->display.present(), rt::Status::ok);
  };
  RenderInputs background;
  background.video_rgb = video;
  RenderInputs with_bodies = background;
  with_bodies.bodies = bodies;
  with_bodies.has_shadows = false;
  RenderInputs hidden = with_bodies;
  hidden.depth_m = depth_m;
  RenderInputs shaded = hidden;
  shaded.has_shadows = true;
  RenderInputs all = shaded;
  all.labels = labels;
  measure("background", [&] { step(background); });
  measure("+ 30 bodies", [&] { step(with_bodies); });
  measure("+ real depth that hides them", [&] { step(hidden); });
  measure("+ shadows", [&] { step(shaded); });
  const double picture_ms = measure("+ overlay", [&] { step(all); });
  const double read_back_ms =
      measure("read-back", [&] { ASSERT_EQ(drawing_->renderer.read_back(rgb), rt::Status::ok); });
  EXPECT_LT(picture_ms + read_back_ms, 33.3);
}

}  // namespace
}  // namespace tactus::render
