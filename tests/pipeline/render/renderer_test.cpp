#include "pipeline/render/renderer.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "pipeline/render/resident.hpp"
#include "tests/pipeline/render/drawing.hpp"
#include "tests/pipeline/render/picture.hpp"

namespace tactus::render {
namespace {

constexpr int kWidth = 160, kHeight = 120;
constexpr double kFocal = 140;
constexpr Rgb8 kGreen{0, 255, 0};

class RendererTest : public test::DrawingTest {
 protected:
  void SetUp() override {
    RenderConfig config;
    config.camera = test::pinhole(kWidth, kHeight, kFocal);
    config.bodies_count_max = 64;
    open(config);
  }

  test::Picture picture(const RenderInputs& inputs, rt::Status expected = rt::Status::ok) {
    test::Picture drawn(kWidth, kHeight);
    EXPECT_EQ(draw(inputs, drawn.rgb), expected);
    return drawn;
  }

  RenderConfig config_;
};

Body sphere(Vec3d center, double radius_m, Rgb8 color = kGreen) {
  const auto r = static_cast<float>(radius_m);
  return {Shape::sphere, color, {r, r, r}, center, {}};
}
Body box(Vec3d center, Vec3f half_m, Quaternion rotation = {}) {
  return {Shape::box, kGreen, half_m, center, rotation};
}

std::vector<std::uint8_t> plain_video(Rgb8 color) {
  std::vector<std::uint8_t> rgb;
  for (int i = 0; i < kWidth * kHeight; ++i) rgb.insert(rgb.end(), {color.r, color.g, color.b});
  return rgb;
}

/// Against a black background every drawn pixel is lit: from below a surface still gets 0.2 of white.
bool is_drawn(const test::Picture& picture, int u, int v) { return picture.at(u, v).g > 20; }

TEST_F(RendererTest, VideoFillsThePictureUnchangedAndUpright) {
  std::mt19937 random(3);
  test::Picture video(kWidth, kHeight);
  for (auto& value : video.rgb) value = static_cast<std::uint8_t>(random());
  RenderInputs inputs;
  inputs.video_rgb = video.rgb;
  EXPECT_EQ(picture(inputs).rgb, video.rgb);
}

TEST_F(RendererTest, WithoutVideoThePictureIsBlackEvenAfterOne) {
  const auto video = plain_video({200, 100, 50});
  RenderInputs inputs;
  inputs.video_rgb = video;
  (void)picture(inputs);
  EXPECT_EQ(picture({}).rgb, test::Picture(kWidth, kHeight).rgb);
}

// The outline of a sphere on the axis is a circle of radius f r / sqrt(d^2 - r^2) pixels around the principal
// point.
TEST_F(RendererTest, SphereOutlineHasTheClosedFormRadius) {
  for (const double radius_m : {0.02, 0.1, 0.3}) {
    const std::array<Body, 1> bodies = {sphere({0, 0, 1}, radius_m)};
    RenderInputs inputs;
    inputs.bodies = bodies;
    const test::Picture drawn = picture(inputs);
    const double radius_px = kFocal * radius_m / std::sqrt(1 - radius_m * radius_m);
    for (int v = 0; v < kHeight; ++v)
      for (int u = 0; u < kWidth; ++u) {
        const double du = u - (kWidth - 1) / 2.0, dv = v - (kHeight - 1) / 2.0;
        const double distance_px = std::sqrt(du * du + dv * dv);
        if (std::fabs(distance_px - radius_px) < 0.02) continue;  // on the line itself rounding decides
        EXPECT_EQ(is_drawn(drawn, u, v), distance_px < radius_px) << u << ' ' << v << " radius " << radius_px;
      }
  }
}

// Through the whole chain (pose, projection, raster, read-back): the middle of the outline of a sphere at (x,
// y, z) is at fx (slope_low + slope_high) / 2 + cx, with the slopes x z / (z^2 - r^2) +- ... of its tangents.
TEST_F(RendererTest, BodyInTheWorldLandsOnItsPixelWithinATenth) {
  T_WorldDepth T_world_depth;
  T_world_depth.rotation = Rotation::from(Quaternion{0.9, 0.2, -0.3, 0.1}.normalized());
  T_world_depth.translation = {1.5, -0.7, 2.2};
  constexpr double kRadius = 0.08;
  for (const Vec3d p :
       {Vec3d{0.2, 0.1, 1.0}, Vec3d{-0.3, -0.2, 1.2}, Vec3d{0.4, -0.25, 1.6}, Vec3d{-0.05, 0.2, 0.9}}) {
    const std::array<Body, 1> bodies = {sphere(T_world_depth * p, kRadius)};
    RenderInputs inputs;
    inputs.bodies = bodies;
    inputs.T_world_depth = T_world_depth;
    const test::Picture drawn = picture(inputs);
    double sum_u = 0, sum_v = 0, count = 0;
    for (int v = 0; v < kHeight; ++v)
      for (int u = 0; u < kWidth; ++u)
        if (is_drawn(drawn, u, v)) {
          sum_u += u;
          sum_v += v;
          ++count;
        }
    ASSERT_GT(count, 100);
    const double a = p.z * p.z - kRadius * kRadius;
    EXPECT_NEAR(sum_u / count, kFocal * p.x * p.z / a + (kWidth - 1) / 2.0, 0.1);
    EXPECT_NEAR(sum_v / count, kFocal * p.y * p.z / a + (kHeight - 1) / 2.0, 0.1);
  }
}

// A box facing the camera is the rectangle of its front face: pixel centres inside it are drawn, others are
// not.
TEST_F(RendererTest, BoxCoversExactlyThePixelsOfItsFrontFace) {
  const std::array<Body, 1> bodies = {box({0.1, -0.05, 1.1}, {0.2F, 0.1F, 0.1F})};  // front face at z = 1
  RenderInputs inputs;
  inputs.bodies = bodies;
  const test::Picture drawn = picture(inputs);
  for (int v = 0; v < kHeight; ++v)
    for (int u = 0; u < kWidth; ++u) {
      const double x = (u - (kWidth - 1) / 2.0) / kFocal, y = (v - (kHeight - 1) / 2.0) / kFocal;
      const bool is_inside = x > -0.1 && x < 0.3 && y > -0.15 && y < 0.05;
      EXPECT_EQ(is_drawn(drawn, u, v), is_inside) << u << ' ' << v;
    }
}

TEST_F(RendererTest, TurnedBoxShowsItsCornersWhereTheyProject) {
  // Turned by 45 degrees about the camera's axis: a square on its corner, 0.2 sqrt(2) m high at z = 1.
  const double half = std::sqrt(0.5);
  const Quaternion turned{std::sqrt((1 + half) / 2), 0, 0, std::sqrt((1 - half) / 2)};
  const std::array<Body, 1> bodies = {box({0, 0, 1.1}, {0.2F, 0.2F, 0.1F}, turned)};
  RenderInputs inputs;
  inputs.bodies = bodies;
  const test::Picture drawn = picture(inputs);
  const double reach_px = 0.2 * std::sqrt(2.0) * kFocal;  // 39.6
  for (int v = 0; v < kHeight; ++v)
    for (int u = 0; u < kWidth; ++u) {
      const double l1 = std::fabs(u - (kWidth - 1) / 2.0) + std::fabs(v - (kHeight - 1) / 2.0);
      if (std::fabs(l1 - reach_px) < 0.05) continue;
      EXPECT_EQ(is_drawn(drawn, u, v), l1 < reach_px) << u << ' ' << v;
    }
}

TEST_F(RendererTest, RealEdgeFadesASphereOverTwoColumnsAndLeavesTheRestExact) {
  constexpr int kEdge = 83;
  std::vector<float> depth_m(kWidth * kHeight);
  for (int v = 0; v < kHeight; ++v)
    for (int u = 0; u < kWidth; ++u)
      depth_m[static_cast<std::size_t>(v * kWidth + u)] = u < kEdge ? 0.5F : 3.0F;
  const auto video = plain_video({255, 0, 0});
  const std::array<Body, 1> bodies = {sphere({0, 0, 1}, 0.2)};
  RenderInputs inputs;
  inputs.video_rgb = video;
  inputs.bodies = bodies;
  const test::Picture whole = picture(inputs);
  inputs.depth_m = depth_m;
  const test::Picture cut = picture(inputs);
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      if (u == kEdge - 1 || u == kEdge) continue;
      EXPECT_EQ(cut.at(u, v), (u < kEdge ? Rgb8{255, 0, 0} : whole.at(u, v))) << u << ' ' << v;
    }
    if (std::abs(v - kHeight / 2) > 20) continue;
    // One of four neighbours is seen before the edge, three behind it.
    EXPECT_NEAR(cut.at(kEdge - 1, v).g, 0.25 * whole.at(kEdge - 1, v).g, 1.0) << v;
    EXPECT_NEAR(cut.at(kEdge, v).g, 0.75 * whole.at(kEdge, v).g, 1.0) << v;
  }
}

TEST_F(RendererTest, RealSurfacesBehindABodyLeaveNoTraceAtItsEdge) {
  std::vector<float> depth_m(kWidth * kHeight, 3.0F);
  for (std::size_t i = 0; i < depth_m.size(); i += 3) depth_m[i] = 1.5F;
  const auto video = plain_video({120, 110, 100});
  const std::array<Body, 2> bodies = {sphere({0, 0, 1}, 0.2), box({0.3, 0, 1.2}, {0.05F, 0.1F, 0.05F})};
  RenderInputs inputs;
  inputs.video_rgb = video;
  inputs.bodies = bodies;
  inputs.has_shadows = false;
  const test::Picture alone = picture(inputs);
  inputs.depth_m = depth_m;
  EXPECT_EQ(picture(inputs).rgb, alone.rgb);
}

TEST_F(RendererTest, RealDepthRowsRunFromTheTop) {
  constexpr int kEdge = 40;
  std::vector<float> depth_m(kWidth * kHeight, 3.0F);
  std::fill(depth_m.begin(), depth_m.begin() + kEdge * kWidth, 0.5F);
  const std::array<Body, 1> bodies = {box({0, 0, 1}, {0.5F, 0.5F, 0.01F})};
  RenderInputs inputs;
  inputs.bodies = bodies;
  inputs.depth_m = depth_m;
  const test::Picture drawn = picture(inputs);
  EXPECT_FALSE(is_drawn(drawn, 80, kEdge - 2));
  EXPECT_TRUE(is_drawn(drawn, 80, kEdge + 1));
}

TEST_F(RendererTest, BiasDecidesWhichRealSurfaceHides) {
  // Front face at z = 2: the bias there is 5 mm + 2.85 mm x 4 = 16.4 mm.
  const std::array<Body, 1> bodies = {box({0, 0, 2.1}, {0.2F, 0.2F, 0.1F})};
  for (const auto& [real_m, is_visible] : {std::pair{1.985F, true}, std::pair{1.982F, false}}) {
    const std::vector<float> depth_m(kWidth * kHeight, real_m);
    RenderInputs inputs;
    inputs.bodies = bodies;
    inputs.depth_m = depth_m;
    EXPECT_EQ(is_drawn(picture(inputs), 80, 60), is_visible) << real_m;
  }
}

TEST_F(RendererTest, PixelsWithoutDepthHideNothing) {
  const std::array<Body, 1> bodies = {sphere({0, 0, 1}, 0.2)};
  RenderInputs inputs;
  inputs.bodies = bodies;
  const test::Picture whole = picture(inputs);
  for (const float none :
       {0.0F, std::numeric_limits<float>::quiet_NaN(), -1.0F, std::numeric_limits<float>::infinity()}) {
    const std::vector<float> depth_m(kWidth * kHeight, none);
    inputs.depth_m = depth_m;
    EXPECT_EQ(picture(inputs).rgb, whole.rgb) << none;
  }
}

// A point of the video at pixel p shows where K R^-1 K^-1 p lies in the picture, and its depth hides there.
TEST_F(RendererTest, TurnedVideoAndDepthLandWhereTheRotationPutsThem) {
  const hal::Intrinsics& camera = drawing_->config.camera;
  const Quaternion q = Quaternion{1, 0.02, -0.035, 0.05}.normalized();
  const Rotation R_video_picture = Rotation::from(q);
  RenderInputs inputs;
  inputs.R_video_picture = R_video_picture;
  const std::array<Body, 1> bodies = {box({0, 0, 2}, {3.0F, 3.0F, 0.01F})};
  for (const auto& [u, v] : {std::pair{80, 60}, {30, 25}, {130, 30}, {40, 95}, {120, 100}}) {
    test::Picture video(kWidth, kHeight);
    std::vector<float> depth_m(kWidth * kHeight, 0.0F);
    for (int y = v - 1; y <= v + 1; ++y)
      for (int x = u - 1; x <= u + 1; ++x) {
        video.set(x, y, {255, 0, 0});
        depth_m[static_cast<std::size_t>(y * kWidth + x)] = 1.0F;
      }
    const Vec3d ray =
        R_video_picture.transposed() * Vec3d{(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1};
    const double expected_u = camera.fx * ray.x / ray.z + camera.cx;
    const double expected_v = camera.fy * ray.y / ray.z + camera.cy;
    const auto expect_spot = [&](const test::Picture& drawn, auto&& is_spot) {
      double sum_u = 0, sum_v = 0, count = 0;
      for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x)
          if (is_spot(drawn.at(x, y))) {
            sum_u += x;
            sum_v += y;
            ++count;
          }
      ASSERT_GT(count, 4);
      EXPECT_NEAR(sum_u / count, expected_u, 0.6);
      EXPECT_NEAR(sum_v / count, expected_v, 0.6);
    };
    inputs.video_rgb = video.rgb;
    inputs.bodies = {};
    expect_spot(picture(inputs), [](Rgb8 c) { return c.r == 255; });
    // A green board behind everything: the spot is what the turned depth hides of it.
    inputs.bodies = bodies;
    inputs.depth_m = depth_m;
    inputs.has_shadows = false;
    inputs.video_rgb = {};
    expect_spot(picture(inputs), [](Rgb8 c) { return c.g < 100; });
    inputs.depth_m = {};
  }
}

TEST_F(RendererTest, WhereATurnedVideoDoesNotReachThePictureIsBlack) {
  const auto video = plain_video({200, 100, 50});
  const std::vector<MaterialId> labels(kWidth * kHeight, 3);
  RenderInputs inputs;
  inputs.video_rgb = video;
  inputs.labels = labels;
  inputs.R_video_picture = Rotation::from(Quaternion{1, 0, 0.1, 0}.normalized());  // 11 degrees to the right
  const test::Picture drawn = picture(inputs);
  EXPECT_NE(drawn.at(5, 60), Rgb8{});
  EXPECT_EQ(drawn.at(kWidth - 5, 60), Rgb8{});
}

TEST_F(RendererTest, NearerBodyHidesTheFartherWhateverTheOrderAndShape) {
  const Body ball = sphere({0, 0, 1}, 0.1, {0, 255, 0});
  Body wall = box({0, 0, 1.5}, {0.5F, 0.5F, 0.05F});
  wall.color = {0, 0, 255};
  // The wall cuts the second ball in half: its front face is at 1.45, in the middle of the ball at (0.3,
  // 0, 1.45).
  const Body half_sunk = sphere({0.3, 0, 1.45}, 0.1, {255, 0, 0});
  const std::array<Body, 3> one = {ball, wall, half_sunk}, other = {half_sunk, wall, ball};
  RenderInputs inputs;
  inputs.bodies = one;
  const test::Picture first = picture(inputs);
  inputs.bodies = other;
  EXPECT_EQ(picture(inputs).rgb, first.rgb);
  const Rgb8 in_front = first.at(80, 60), behind = first.at(50, 60);
  EXPECT_GT(in_front.g, in_front.b);
  EXPECT_GT(behind.b, behind.g);
  const int u = static_cast<int>(std::lround(0.3 / 1.45 * kFocal + (kWidth - 1) / 2.0));
  EXPECT_GT(first.at(u, 60).r, first.at(u, 60).b);
}

TEST_F(RendererTest, SideTowardsTheLightIsBrighter) {
  const std::array<Body, 1> bodies = {sphere({0, 0, 1}, 0.2)};
  RenderInputs inputs;
  inputs.bodies = bodies;
  // World y is up; this camera is upright: y_depth = -y_world, z_depth = -z_world.
  inputs.T_world_depth.rotation = Rotation{{1, 0, 0, 0, -1, 0, 0, 0, -1}};
  const std::array<Body, 1> in_front = {sphere({0, 0, -1}, 0.2)};
  inputs.bodies = in_front;
  const test::Picture drawn = picture(inputs);
  EXPECT_GT(drawn.at(80, 60 - 20).g, drawn.at(80, 60 + 20).g + 60);  // from above
  EXPECT_GT(drawn.at(80 + 15, 60).g, drawn.at(80 - 15, 60).g + 10);  // and from the right
}

TEST_F(RendererTest, FullOverlayIsExactlyThePaletteAndUnknownIsVideo) {
  const auto video = plain_video({10, 20, 30});
  std::vector<MaterialId> labels(kWidth * kHeight);
  for (std::size_t i = 0; i < labels.size(); ++i) labels[i] = static_cast<MaterialId>(i % 256);
  RenderInputs inputs;
  inputs.video_rgb = video;
  inputs.labels = labels;
  inputs.overlay_alpha = 1;
  const test::Picture drawn = picture(inputs);
  for (int v = 0; v < kHeight; ++v)
    for (int u = 0; u < kWidth; ++u) {
      const MaterialId id = labels[static_cast<std::size_t>(v * kWidth + u)];
      ASSERT_EQ(drawn.at(u, v), id < kMaterialCount ? material_color(id) : (Rgb8{10, 20, 30})) << int{id};
    }
}

TEST_F(RendererTest, OverlayBlendsWithTheVideo) {
  const auto video = plain_video({100, 20, 30});
  const MaterialId wood = material_from_name("wood");
  const std::vector<MaterialId> labels(kWidth * kHeight, wood);
  RenderInputs inputs;
  inputs.video_rgb = video;
  inputs.labels = labels;
  for (const float alpha : {0.0F, 0.25F, 0.5F, 0.9F}) {
    inputs.overlay_alpha = alpha;
    const Rgb8 shown = picture(inputs).at(33, 44), color = material_color(wood);
    const auto mixed = [alpha](int behind, int front) {
      return static_cast<float>(behind) * (1 - alpha) + static_cast<float>(front) * alpha;
    };
    EXPECT_NEAR(shown.r, mixed(100, color.r), 1.0F) << alpha;
    EXPECT_NEAR(shown.g, mixed(20, color.g), 1.0F) << alpha;
    EXPECT_NEAR(shown.b, mixed(30, color.b), 1.0F) << alpha;
  }
}

TEST_F(RendererTest, OverlayLiesOnRealThingsNotOnBodies) {
  const std::vector<MaterialId> labels(kWidth * kHeight, material_from_name("carpet"));
  const std::array<Body, 1> bodies = {sphere({0, 0, 1}, 0.2)};
  RenderInputs inputs;
  inputs.bodies = bodies;
  const Rgb8 without = picture(inputs).at(80, 60);
  inputs.labels = labels;
  const test::Picture drawn = picture(inputs);
  EXPECT_EQ(drawn.at(80, 60), without);
  EXPECT_NE(drawn.at(2, 2), Rgb8{});
}

TEST_F(RendererTest, WithoutAPoseOnlyTheVideoIsShown) {
  const auto video = plain_video({10, 20, 30});
  const std::array<Body, 1> bodies = {sphere({0, 0, 1}, 0.2)};
  RenderInputs inputs;
  inputs.video_rgb = video;
  inputs.bodies = bodies;
  inputs.is_tracked = false;
  EXPECT_EQ(picture(inputs).rgb, video);
  inputs.is_tracked = true;
  inputs.T_world_depth.translation.x = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(picture(inputs, rt::Status::lost).rgb, video);
}

TEST_F(RendererTest, TooManyBodiesAnswersFullAndDrawsTheFirst) {
  std::vector<Body> bodies(65, sphere({0, 0, 1}, 0.05));
  bodies.back() = sphere({0.3, 0, 1}, 0.05);
  RenderInputs inputs;
  inputs.bodies = bodies;
  const test::Picture drawn = picture(inputs, rt::Status::full);
  EXPECT_TRUE(is_drawn(drawn, 80, 60));
  EXPECT_FALSE(is_drawn(drawn, 80 + 42, 60));
}

TEST_F(RendererTest, SameInputsDrawTheSamePictureTwice) {
  std::vector<Body> bodies;
  for (int i = 0; i < 30; ++i) {
    const Vec3d center{0.05 * (i % 6) - 0.1, 0.05 * (i / 6) - 0.1, 1 + 0.02 * i};
    bodies.push_back(i % 2 == 0 ? sphere(center, 0.04)
                                : box(center, {0.03F, 0.02F, 0.04F}, {0.8, 0.6, 0, 0}));
  }
  RenderInputs inputs;
  inputs.bodies = bodies;
  const test::Picture first = picture(inputs);
  (void)picture({});
  EXPECT_EQ(picture(inputs).rgb, first.rgb);
}

TEST_F(RendererTest, ResidentSetStaysFlatOver300Frames) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "a sanitizer keeps freed memory, so that the resident set says nothing about the driver";
#endif
  const auto video = plain_video({10, 20, 30});
  const std::vector<float> depth_m(kWidth * kHeight, 1.0F);
  const std::vector<MaterialId> labels(kWidth * kHeight, 3);
  std::vector<Body> bodies;
  for (int i = 0; i < 60; ++i)
    bodies.push_back(sphere({0.1 * (i % 10) - 0.45, 0.1 * (i / 10) - 0.25, 1}, 0.04));
  const std::array<Decal, 1> decals = {Decal{DecalKind::cracks, {0, 0, 1}, {0, 0, -1}, 0.1F, {}, 1}};
  RenderInputs inputs;
  inputs.decals = decals;
  inputs.video_rgb = video;
  inputs.depth_m = depth_m;
  inputs.labels = labels;
  inputs.bodies = bodies;
  test::Picture drawn(kWidth, kHeight);
  const auto frame = [&] { (void)draw(inputs, drawn.rgb); };
  for (int i = 0; i < 20; ++i) frame();
  const auto growth_bytes = resident_growth_bytes(300, frame);
  ASSERT_TRUE(growth_bytes.has_value());
  RecordProperty("growth_bytes", std::to_string(*growth_bytes));
  EXPECT_LT(*growth_bytes, 1 << 20);
}

TEST(ResidentBytes, GrowsWithMemoryThatIsTouched) {
  constexpr std::size_t kBytes = 32U << 20;
  std::unique_ptr<std::uint8_t[]> held;
  const auto growth_bytes =
      resident_growth_bytes(1, [&] { held = std::make_unique<std::uint8_t[]>(kBytes); });
  ASSERT_TRUE(growth_bytes.has_value());
  EXPECT_EQ(held[kBytes - 1], 0);
  EXPECT_GT(*growth_bytes, static_cast<std::int64_t>(kBytes * 9 / 10));
}

TEST_F(RendererTest, BindRefusesWhatItCannotShowWithOneSentence) {
  const auto refusal = [this](auto&& change) {
    RenderConfig config = drawing_->config;
    change(config);
    Renderer sut;
    const auto bound = sut.bind(config, drawing_->slice());
    EXPECT_FALSE(bound.has_value());
    return bound.has_value() ? rt::Error{} : bound.error();
  };
  const rt::Error distorted = refusal([](RenderConfig& c) { c.camera.k1 = 0.1; });
  EXPECT_EQ(distorted.code, rt::ExitCode::bad_usage);
  EXPECT_NE(distorted.message.find("distortion"), std::string::npos);
  EXPECT_EQ(refusal([](RenderConfig& c) { c.camera.width = 0; }).code, rt::ExitCode::bad_usage);
  EXPECT_EQ(refusal([](RenderConfig& c) { c.camera.fx = std::nan(""); }).code, rt::ExitCode::bad_usage);
  EXPECT_EQ(refusal([](RenderConfig& c) { c.clip.far_m = c.clip.near_m; }).code, rt::ExitCode::bad_usage);
  static const std::array<Vec3f, 2> kTwoVertices = {Vec3f{0, 0, 1}, Vec3f{1, 0, 0}};
  static const std::array<std::array<std::uint16_t, 3>, 1> kTriangle = {{{0, 1, 2}}};
  static const std::array<HullMesh, 1> kHulls = {HullMesh{kTwoVertices, kTriangle}};
  const rt::Error no_vertex = refusal([](RenderConfig& c) { c.hulls = kHulls; });
  EXPECT_EQ(no_vertex.code, rt::ExitCode::bad_usage);
  EXPECT_NE(no_vertex.message.find("hull 0"), std::string::npos);
}

TEST_F(RendererTest, BindWithoutAContextSaysSo) {
  drawing_->display.release();
  Renderer sut;
  const auto bound = sut.bind(drawing_->config, drawing_->slice());
  ASSERT_FALSE(bound);
  EXPECT_EQ(bound.error().code, rt::ExitCode::device_unavailable);
  ASSERT_EQ(drawing_->display.begin(), rt::Status::ok);
}

TEST_F(RendererTest, ImagesOfAnotherSizeAreABug) {
  const std::vector<float> depth_m(7, 1.0F);
  RenderInputs inputs;
  inputs.depth_m = depth_m;
  EXPECT_DEATH((void)drawing_->renderer.step(inputs), "assertion failed");
}

}  // namespace
}  // namespace tactus::render
