#include "hal/synthetic/synthetic.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <string>
#include <vector>

#include "tests/hal/replay/counted_new.hpp"

namespace tactus::hal::synthetic {
namespace {

SyntheticOptions small(SceneId scene, int frames_count) {
  SyntheticOptions options;
  options.scene = scene;
  options.mode = Mode::qvga_320x240;
  options.frames_count = frames_count;
  return options;
}
constexpr std::size_t kPixels = 320 * 240;

TEST(SyntheticSensor, DeliversItsFramesInOrderAndEnds) {
  auto sensor = open_synthetic(small(SceneId::corner, 4));
  ASSERT_TRUE(sensor);
  Sensor& sut = *sensor;
  EXPECT_EQ(sut.frames_count, 4U);
  EXPECT_EQ(sut.truth.size(), 4U);
  std::vector<std::uint16_t> depth(kPixels);
  std::vector<std::uint8_t> rgb(kPixels * 3);
  rt::SensorTime before{-1};
  for (std::uint64_t i = 0; i < 4; ++i) {
    FrameHeader of_depth, of_color;
    ASSERT_EQ(sut.depth->read(depth, of_depth, {}), rt::Status::ok);
    ASSERT_EQ(sut.color->read(rgb, of_color, {}), rt::Status::ok);
    EXPECT_EQ(of_depth.sequence, i);
    EXPECT_EQ(of_color.sequence, i);
    EXPECT_EQ(of_depth.time, of_color.time);
    EXPECT_EQ(of_depth.time, sut.truth[i].time);
    EXPECT_GT(of_depth.time, before);
    EXPECT_NEAR(of_depth.time.seconds(), static_cast<double>(i) / 30, 1e-8);
    before = of_depth.time;
  }
  FrameHeader header;
  EXPECT_EQ(sut.depth->read(depth, header, {}), rt::Status::end_of_stream);
  EXPECT_EQ(sut.color->read(rgb, header, {}), rt::Status::end_of_stream);
  EXPECT_EQ(sut.depth->counters().frames_delivered, 4U);
  EXPECT_EQ(sut.depth->counters().frames_rejected, 0U);
}

TEST(SyntheticSensor, ImpossibleOptionsAreRefusedWithASentence) {
  const auto sut = open_synthetic(small(SceneId::corner, 0));
  ASSERT_FALSE(sut);
  EXPECT_NE(sut.error().message.find("frames"), std::string::npos);
}

TEST(SyntheticSensor, GravityIsWorldDownInTheFirstFrame) {
  const auto sensor = open_synthetic(small(SceneId::bedroom, 2));
  ASSERT_TRUE(sensor);
  ASSERT_TRUE(sensor->gravity_depth.has_value());
  const Vec3d down = sensor->truth.front().T_world_depth.rotation * *sensor->gravity_depth;
  EXPECT_LT((down - Vec3d{0, -1, 0}).norm(), 1e-12);
  EXPECT_GT(sensor->gravity_depth->y, 0.8);  // held upright, optical y looks down
}

TEST(SyntheticSensor, RoomsShowAll23Materials) {
  std::array<long, 256> most{};  // pixels in the frame that shows most of it
  for (const SceneId id : {SceneId::bedroom, SceneId::office}) {
    auto sensor = open_synthetic(small(id, 300));
    ASSERT_TRUE(sensor);
    std::vector<std::uint8_t> labels(kPixels);
    for (std::uint64_t frame = 0; frame < 300; frame += 15) {
      ASSERT_EQ(sensor->labels->read(frame, labels), rt::Status::ok);
      std::array<long, 256> counts{};
      for (const std::uint8_t id_of_pixel : labels) ++counts[id_of_pixel];
      for (std::size_t i = 0; i < counts.size(); ++i) most[i] = std::max(most[i], counts[i]);
      EXPECT_EQ(counts[kNoMaterial], 0) << "the rooms are closed";
    }
    EXPECT_EQ(sensor->labels->read(300, labels), rt::Status::end_of_stream);
  }
  for (std::size_t i = 0; i < kMaterialsCount; ++i) EXPECT_GE(most[i], 40) << "material " << i;
}

TEST(SyntheticSensor, BlankFramesAreZeroAndTheRestGoesOn) {
  SyntheticOptions options = small(SceneId::corner, 8);
  options.blank_first = 3;
  options.blank_count = 2;
  options.has_jump = true;
  auto sensor = open_synthetic(options);
  ASSERT_TRUE(sensor);
  std::vector<std::uint16_t> depth(kPixels);
  std::vector<std::uint8_t> rgb(kPixels * 3);
  for (int i = 0; i < 8; ++i) {
    FrameHeader header;
    ASSERT_EQ(sensor->depth->read(depth, header, {}), rt::Status::ok);
    ASSERT_EQ(sensor->color->read(rgb, header, {}), rt::Status::ok);
    const bool is_blank = i == 3 || i == 4;
    EXPECT_EQ(std::accumulate(depth.begin(), depth.end(), 0L) == 0, is_blank) << i;
    EXPECT_EQ(std::accumulate(rgb.begin(), rgb.end(), 0L) == 0, is_blank) << i;
  }
  const Vec3d before = sensor->truth[4].T_world_depth.translation,
              after = sensor->truth[5].T_world_depth.translation;
  EXPECT_NEAR((after - before).norm(), 0.13, 0.01);
}

TEST(SyntheticSensor, ReadingAllocatesNothing) {
  for (const bool is_registered : {true, false}) {
    SyntheticOptions options = small(SceneId::office, 3);
    options.is_registered = is_registered;
    auto sensor = open_synthetic(options);
    ASSERT_TRUE(sensor);
    std::vector<std::uint16_t> depth(kPixels);
    std::vector<std::uint8_t> rgb(kPixels * 3), labels(kPixels);
    FrameHeader header;
    const std::uint64_t before = test::heap_calls_count();
    for (std::uint64_t i = 0; i < 3; ++i) {
      ASSERT_EQ(sensor->depth->read(depth, header, {}), rt::Status::ok);
      ASSERT_EQ(sensor->color->read(rgb, header, {}), rt::Status::ok);
      ASSERT_EQ(sensor->labels->read(i, labels), rt::Status::ok);
    }
    EXPECT_EQ(test::heap_calls_count(), before);
  }
}

TEST(FrameRenderer, FramesDoNotDependOnTheOrderTheyAreAskedIn) {
  const SyntheticOptions options = small(SceneId::office, 50);
  const auto scene = std::make_shared<const Scene>(make_scene(options.scene));
  FrameRenderer forward(scene, options), backward(scene, options);
  std::vector<std::vector<std::uint16_t>> depths;
  std::vector<std::vector<std::uint8_t>> colors;
  for (const int frame : {3, 17, 42}) {
    depths.emplace_back(kPixels);
    colors.emplace_back(kPixels * 3);
    forward.depth(frame, depths.back());
    forward.color(frame, colors.back());
  }
  std::vector<std::uint16_t> depth(kPixels);
  std::vector<std::uint8_t> rgb(kPixels * 3), labels(kPixels);
  std::size_t i = 3;
  for (const int frame : {42, 17, 3}) {
    --i;
    backward.color(frame, rgb);
    backward.labels(frame, labels);
    backward.depth(frame, depth);
    EXPECT_EQ(depth, depths[i]);
    EXPECT_EQ(rgb, colors[i]);
  }
}

TEST(FrameRenderer, WithoutNoiseDepthIsTheExactDepthRounded) {
  for (const Mode mode : {Mode::vga_640x480, Mode::wide_960x540, Mode::qvga_320x240}) {
    SyntheticOptions options;
    options.mode = mode;
    options.has_noise = false;
    FrameRenderer sut(std::make_shared<const Scene>(make_scene(options.scene)), options);
    const auto pixels = static_cast<std::size_t>(sut.calibration().depth.width) *
                        static_cast<std::size_t>(sut.calibration().depth.height);
    std::vector<std::uint16_t> raw(pixels);
    std::vector<float> exact(pixels);
    sut.depth(70, raw);
    sut.exact_depth(70, exact);
    for (std::size_t i = 0; i < pixels; ++i) {
      const double expected =
          static_cast<double>(exact[i]) < 65535.4 * 0.0002 ? static_cast<double>(exact[i]) : 0;
      ASSERT_NEAR(raw[i] * 0.0002, expected, 0.000101);
    }
  }
}

TEST(FrameRenderer, EveryModeSeesTheSameRoom) {
  // A pixel of the small image covers four of the large one; away from creases its depth lies among theirs.
  SyntheticOptions options;
  const auto scene = std::make_shared<const Scene>(make_scene(options.scene));
  FrameRenderer large(scene, options);
  FrameRenderer little(scene, small(options.scene, 300));
  std::vector<float> z_large(640 * 480), z_small(kPixels);
  large.exact_depth(33, z_large);
  little.exact_depth(33, z_small);
  long checked = 0, among = 0;
  for (std::size_t row = 0; row < 240; ++row)
    for (std::size_t column = 0; column < 320; ++column) {
      const std::size_t i = row * 2 * 640 + column * 2;
      const auto [low, high] = std::minmax({z_large[i], z_large[i + 1], z_large[i + 640], z_large[i + 641]});
      if (high - low > 0.01F) continue;
      ++checked;
      const float z = z_small[row * 320 + column];
      among += z >= low - 0.0005F && z <= high + 0.0005F ? 1 : 0;
    }
  EXPECT_GT(checked, 50000);
  EXPECT_GT(static_cast<double>(among) / static_cast<double>(checked), 0.99);
}

TEST(FrameRenderer, UnregisteredColorShowsTheSurfaceThatDepthSees) {
  // Each exact depth pixel, carried into the colour camera by calibration alone, must find the colour that
  // the registered camera sees there; light does not depend on the viewer.
  SyntheticOptions options;
  options.has_noise = false;
  const auto scene = std::make_shared<const Scene>(make_scene(options.scene));
  FrameRenderer registered(scene, options);
  options.is_registered = false;
  FrameRenderer sut(scene, options);
  std::vector<float> z(640 * 480);
  std::vector<std::uint8_t> rgb_registered(640 * 480 * 3), rgb(640 * 480 * 3);
  registered.exact_depth(90, z);
  registered.color(90, rgb_registered);
  sut.color(90, rgb);
  const RigCalibration& rig = sut.calibration();
  long checked = 0, matching = 0, matching_unmoved = 0;
  for (int row = 4; row < 476; row += 3)
    for (int column = 4; column < 636; column += 3) {
      const auto i = static_cast<std::size_t>(row * 640 + column);
      const auto depth_m = static_cast<double>(z[i]);
      const Vec3d p = rig.T_color_depth * Vec3d{(column - rig.depth.cx) / rig.depth.fx * depth_m,
                                                (row - rig.depth.cy) / rig.depth.fy * depth_m, depth_m};
      const double x = p.x / p.z, y = p.y / p.z, r2 = x * x + y * y;
      const Intrinsics& k = rig.color;
      const double radial = 1 + k.k1 * r2 + k.k2 * r2 * r2 + k.k3 * r2 * r2 * r2;
      const double u = k.fx * (x * radial + 2 * k.p1 * x * y + k.p2 * (r2 + 2 * x * x)) + k.cx;
      const double v = k.fy * (y * radial + k.p1 * (r2 + 2 * y * y) + 2 * k.p2 * x * y) + k.cy;
      if (u < 1 || v < 1 || u > 638 || v > 478) continue;
      const auto matches = [&](double at_u, double at_v) {
        const auto j = static_cast<std::size_t>(std::lround(at_v) * 640 + std::lround(at_u));
        int difference = 0;
        for (std::size_t c = 0; c < 3; ++c)
          difference += std::abs(rgb[j * 3 + c] - rgb_registered[i * 3 + c]);
        return difference <= 36;
      };
      ++checked;
      matching += matches(u, v) ? 1 : 0;
      matching_unmoved += matches(column, row) ? 1 : 0;
    }
  ASSERT_GT(checked, 20000);
  // Edges of solids and texture differ by up to half a pixel.
  EXPECT_GT(static_cast<double>(matching) / static_cast<double>(checked), 0.88);
  EXPECT_LT(static_cast<double>(matching_unmoved) / static_cast<double>(checked), 0.75);
}

TEST(FrameRenderer, ColorHasContrastEverywhereInTheLoop) {
  FrameRenderer sut(std::make_shared<const Scene>(make_scene(SceneId::bedroom)),
                    small(SceneId::bedroom, 300));
  std::vector<std::uint8_t> rgb(kPixels * 3);
  for (int frame = 0; frame < 300; frame += 50) {
    sut.color(frame, rgb);
    double sum = 0, squares = 0;
    long burnt = 0;
    for (std::size_t i = 0; i < kPixels; ++i) {
      const double luma = (rgb[3 * i] + 2.0 * rgb[3 * i + 1] + rgb[3 * i + 2]) / 4;
      sum += luma;
      squares += luma * luma;
      burnt += luma > 250 ? 1 : 0;
    }
    const double mean = sum / kPixels;
    EXPECT_GT(mean, 60);
    EXPECT_LT(mean, 200);
    EXPECT_GT(std::sqrt(squares / kPixels - mean * mean), 25);
    EXPECT_LT(burnt, static_cast<long>(kPixels) / 20);
  }
}

}  // namespace
}  // namespace tactus::hal::synthetic
