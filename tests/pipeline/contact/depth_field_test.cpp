#include "pipeline/contact/depth_field.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include "hal/synthetic/synthetic.hpp"
#include "pipeline/contact/map_field.hpp"
#include "pipeline/map/map.hpp"
#include "tests/pipeline/contact/analytic_field.hpp"
#include "tests/pipeline/contact/test_shapes.hpp"

namespace tactus::contact {
namespace {

/// A floor at y = 0 and a wall at z = -1.5.
double room(const Vec3d& p) { return std::min(p.y, p.z + 1.5); }

/// A camera at 1 m that looks down by 35 degrees, and its picture of the room in whole millimetres.
class RoomPicture {
 public:
  explicit RoomPicture(double sigma_m = 0, unsigned seed = 1) {
    view_.camera = {.width = 320, .height = 240, .fx = 270, .fy = 270, .cx = 159.5, .cy = 119.5};
    const double s = std::sin(0.61), c = std::cos(0.61);
    view_.T_world_depth = {{{1, 0, 0, 0, -c, -s, 0, s, -c}}, {0, 1, 0}};
    raw_.resize(320 * 240);
    std::mt19937 random(seed);
    std::normal_distribution<double> noise(0, sigma_m);
    for (int v = 0; v < 240; ++v)
      for (int u = 0; u < 320; ++u) {
        const Vec3d ray{(u - view_.camera.cx) / 270, (v - view_.camera.cy) / 270, 1};
        const Vec3d d = view_.T_world_depth.rotation * ray;
        const double to_floor = d.y < 0 ? -1 / d.y : 1e9, to_wall = d.z < 0 ? -1.5 / d.z : 1e9;
        const double z_m = std::min(to_floor, to_wall) + (sigma_m > 0 ? noise(random) : 0);
        raw_[static_cast<std::size_t>(v * 320 + u)] = static_cast<std::uint16_t>(std::lround(z_m * 1000));
      }
    view_.raw_depth = raw_;
    view_.is_valid = true;
  }
  DepthView& view() { return view_; }
  std::vector<std::uint16_t>& raw() { return raw_; }
  [[nodiscard]] const std::vector<std::uint16_t>& raw() const { return raw_; }

 private:
  std::vector<std::uint16_t> raw_;
  DepthView view_;
};

TEST(DepthField, DistanceOnAFloorAndAWallIsTheTrueOne) {
  RoomPicture picture;
  const unsigned seed = 5;
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  int known = 0;
  for (int i = 0; i < 4000; ++i) {
    const bool floor = i % 2 == 0;
    const Vec3d p = floor ? Vec3d{0.4 * unit(random), 0.03 * unit(random), -0.9 + 0.4 * unit(random)}
                          : Vec3d{0.4 * unit(random), 0.5 + 0.3 * unit(random), -1.5 + 0.03 * unit(random)};
    map::DistanceSample s;
    if (!sample_depth(picture.view(), 0.04, p, s)) continue;
    ++known;
    EXPECT_NEAR(static_cast<double>(s.distance_m), room(p), 0.0015);
    EXPECT_GT(floor ? s.gradient.y : s.gradient.z, 0.99F);
  }
  EXPECT_GT(known, 3000) << "the others lie outside the picture";
}

TEST(DepthField, SaturatesInFrontAndKnowsNothingBehindTheBand) {
  RoomPicture picture;
  map::DistanceSample s;
  ASSERT_TRUE(sample_depth(picture.view(), 0.04, {0, 0.3, -0.9}, s));
  EXPECT_FLOAT_EQ(s.distance_m, 0.04F);
  EXPECT_FALSE(sample_depth(picture.view(), 0.04, {0, -0.06, -0.9}, s));
  EXPECT_FALSE(sample_depth(picture.view(), 0.04, {0, -0.6, -0.9}, s));
  EXPECT_FALSE(sample_depth(picture.view(), 0.04, {3, 0.01, -0.9}, s)) << "outside the picture";
  EXPECT_FALSE(sample_depth(picture.view(), 0.04, {0, 0.01, 0.9}, s)) << "behind the camera";
  picture.view().is_valid = false;
  EXPECT_FALSE(sample_depth(picture.view(), 0.04, {0, 0.01, -0.9}, s));
}

TEST(DepthField, PixelWithoutDepthIsUnknownAndAnEdgeIsNotASlope) {
  RoomPicture picture;
  const Vec3d p{0, 0.01, -0.9};
  const Vec3d p_depth = picture.view().T_world_depth.inverse() * p;
  const int u = static_cast<int>(270 * p_depth.x / p_depth.z + 160),
            v = static_cast<int>(270 * p_depth.y / p_depth.z + 120);
  map::DistanceSample s;
  // Everything to the right of the pixel stands half a metre nearer: the floor's gradient stays the floor's.
  for (int row = 0; row < 240; ++row)
    for (int column = u + 2; column < 320; ++column)
      picture.raw()[static_cast<std::size_t>(row * 320 + column)] = 500;
  ASSERT_TRUE(sample_depth(picture.view(), 0.04, p, s));
  EXPECT_GT(s.gradient.y, 0.99F);
  EXPECT_NEAR(s.distance_m, 0.01F, 0.002F);
  picture.raw()[static_cast<std::size_t>(v * 320 + u)] = 0;
  EXPECT_FALSE(sample_depth(picture.view(), 0.04, p, s));
}

TEST(DepthField, TheMapAnswersFirstAndAloneForMaterials) {
  RoomPicture picture;
  test::AnalyticField map([](const Vec3d& p) { return p.y - 0.02; }, material_from_name("carpet"));
  const DepthBackedField both(map.field(), picture.view());
  map::DistanceSample s;
  ASSERT_TRUE(both.field().sample({0, 0.03, -0.9}, s));
  EXPECT_NEAR(s.distance_m, 0.01F, 1e-5F);
  map.set_solid(false);
  ASSERT_TRUE(both.field().sample({0, 0.03, -0.9}, s));
  EXPECT_NEAR(s.distance_m, 0.03F, 2e-3F);
  MaterialDistribution materials;
  EXPECT_TRUE(both.field().materials({0, 0, -0.9}, materials));
  map.set_material(kUnknownMaterial);
  EXPECT_FALSE(both.field().materials({0, 0, -0.9}, materials));
}

class TakeOver : public testing::TestWithParam<std::size_t> {};
INSTANTIATE_TEST_SUITE_P(Shapes, TakeOver, testing::Range(std::size_t{0}, test::lying_shapes().size()),
                         test::NameOfLying{});

BodySpec above_the_floor(const test::Lying& lying) {
  BodySpec spec;
  spec.shape = lying.shape;
  spec.q_world_body = lying.q_world_body;
  spec.position_world_m = {0.05, lying.height_m + 0.1, -0.9};
  return spec;
}

TEST_P(TakeOver, BodyDroppedBeforeTheMapExistsStaysWhereItIsWhenTheMapAppears) {
  RoomPicture picture;
  test::AnalyticField map(room);
  map.set_solid(false);
  const DepthBackedField both(map.field(), picture.view());
  test::BoundWorld sut(both.field());
  const test::Lying lying = test::lying_shapes()[GetParam()];
  const BodyId id = sut.spawn(above_the_floor(lying));
  sut.run(4);
  ASSERT_NE(sut.find(id), nullptr);
  const BodyState before = *sut.find(id);
  EXPECT_NEAR(before.position_world_m.y, lying.height_m, 0.002);
  EXPECT_TRUE(before.resting);

  map.set_solid(true);
  double highest_m = before.position_world_m.y;
  for (int i = 0; i < 480; ++i) {
    sut.run_step();
    highest_m = std::max(highest_m, sut.find(id)->position_world_m.y);
  }
  EXPECT_LT((sut.find(id)->position_world_m - before.position_world_m).norm(), 0.002);
  EXPECT_LT(highest_m, before.position_world_m.y + 0.002) << "lifted into the air";
  sut.world.wake_all();
  sut.run(2);
  EXPECT_NEAR(sut.find(id)->position_world_m.y, lying.height_m, 0.0006);
}

TEST_P(TakeOver, NoiseOfTheCameraNeitherSinksNorThrowsABody) {
  const unsigned seed = 3;
  SCOPED_TRACE("seed " + std::to_string(seed));
  const test::Lying lying = test::lying_shapes()[GetParam()];
  test::AnalyticField map(room);
  map.set_solid(false);
  RoomPicture picture(0.0015, seed);
  const DepthBackedField both(map.field(), picture.view());
  test::BoundWorld sut(both.field());
  const BodyId id = sut.spawn(above_the_floor(lying));
  sut.run(1.5);
  for (unsigned frame = 0; frame < 40; ++frame) {  // a new picture every four steps
    const RoomPicture next(0.0015, seed + frame);
    std::copy(next.raw().begin(), next.raw().end(), picture.raw().begin());
    for (int i = 0; i < 4; ++i) sut.run_step();
    ASSERT_NE(sut.find(id), nullptr);
    EXPECT_NEAR(sut.find(id)->position_world_m.y, lying.height_m, 0.004) << frame;
  }
}

TEST(DepthField, BodiesDroppedInTheFirstFrameOfTheBedroomDoNotFallThrough) {
  const auto options = hal::parse_synthetic_name("synthetic:bedroom");
  ASSERT_TRUE(options.has_value());
  hal::synthetic::FrameRenderer renderer(
      std::make_shared<const hal::synthetic::Scene>(hal::synthetic::make_scene(options.value().scene)),
      options.value());
  const hal::RigCalibration& rig = renderer.calibration();
  std::vector<std::uint16_t> raw(static_cast<std::size_t>(rig.depth.width) *
                                 static_cast<std::size_t>(rig.depth.height));
  renderer.depth(0, raw);
  DepthView view{raw, rig.depth_m_per_unit, rig.depth, renderer.pose(0), true};

  map::MapConfig config;
  config.blocks_capacity = 16;
  const std::size_t bytes = map::Map::bytes_needed(config);
  const std::unique_ptr<std::byte, void (*)(std::byte*)> memory(
      static_cast<std::byte*>(::operator new (bytes, std::align_val_t{64})),
      [](std::byte* p) { ::operator delete (p, std::align_val_t{64}); });
  map::Map map;
  map.bind(rt::Slice(std::span(memory.get(), bytes)), config);
  const map::Reader reader(map);
  const DepthBackedField both(field_of(reader), view);

  test::BoundWorld sut(both.field());
  std::vector<BodyId> ids;
  std::vector<Vec3d> surfaces;
  const int columns = rig.depth.width / 16;
  for (int i = 0; i < columns * (rig.depth.height / 16) && ids.size() < 20; ++i) {
    // Onto what the picture shows, where it is level a hand around.
    const int u = 16 * (i % columns), v = 16 * (i / columns);
    const double z_m = raw[static_cast<std::size_t>(v * rig.depth.width + u)] * rig.depth_m_per_unit;
    map::DistanceSample s;
    const Vec3d surface = view.T_world_depth * Vec3d{(u - rig.depth.cx) / rig.depth.fx * z_m,
                                                     (v - rig.depth.cy) / rig.depth.fy * z_m, z_m};
    const auto is_level = [&](const Vec3d& p) {
      return sample_depth(view, 0.04, p, s) && s.gradient.y > 0.97F && std::abs(s.distance_m) < 0.01F;
    };
    if (z_m == 0 || !is_level(surface)) continue;
    constexpr double kRoom = 0.08;  // what falls off an edge falls into what nobody has seen
    if (!is_level(surface + Vec3d{kRoom, 0, 0}) || !is_level(surface - Vec3d{kRoom, 0, 0}) ||
        !is_level(surface + Vec3d{0, 0, kRoom}) || !is_level(surface - Vec3d{0, 0, kRoom}))
      continue;
    const auto is_near = [&](const Vec3d& other) { return (other - surface).norm() < 0.15; };
    if (std::any_of(surfaces.begin(), surfaces.end(), is_near)) continue;
    BodySpec spec;
    spec.shape = ids.size() % 2 == 0 ? Shape::box({0.03, 0.02, 0.03}) : Shape::convex(test::nut_hull());
    spec.position_world_m = surface + Vec3d{0, 0.12, 0};
    ids.push_back(sut.spawn(spec));
    surfaces.push_back(surface);
  }
  ASSERT_GE(ids.size(), 6U);
  sut.run(2);
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const BodyState* state = sut.find(ids[i]);
    ASSERT_NE(state, nullptr);
    EXPECT_GT(state->position_world_m.y, surfaces[i].y + 0.01) << i;
    EXPECT_LT(state->velocity_world_m_per_s.norm(), 0.1) << i;
  }
}

}  // namespace
}  // namespace tactus::contact
