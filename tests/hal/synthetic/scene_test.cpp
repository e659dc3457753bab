#include "hal/synthetic/scene.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "pipeline/label/material.hpp"

namespace tactus::hal::synthetic {
namespace {

constexpr unsigned kSeed = 7;

Vec3d random_point_in(const Scene& scene, std::mt19937& random) {
  const Vec3d low = scene.room_min_m(), size = scene.room_max_m() - low;
  std::uniform_real_distribution<double> u(0, 1);
  return {low.x + size.x * u(random), low.y + size.y * u(random), low.z + size.z * u(random)};
}

TEST(SyntheticMaterial, IdsAreThePipelines) {
  static_assert(kMaterialsCount == kMaterialCount);
  static_assert(kNoMaterial == kUnknownMaterial);
  const auto id = [](Material m) { return static_cast<MaterialId>(m); };
  EXPECT_EQ(id(Material::brick), material_from_name("brick"));
  EXPECT_EQ(id(Material::carpet), material_from_name("carpet"));
  EXPECT_EQ(id(Material::ceramic), material_from_name("ceramic"));
  EXPECT_EQ(id(Material::fabric), material_from_name("fabric"));
  EXPECT_EQ(id(Material::foliage), material_from_name("foliage"));
  EXPECT_EQ(id(Material::food), material_from_name("food"));
  EXPECT_EQ(id(Material::glass), material_from_name("glass"));
  EXPECT_EQ(id(Material::hair), material_from_name("hair"));
  EXPECT_EQ(id(Material::leather), material_from_name("leather"));
  EXPECT_EQ(id(Material::metal), material_from_name("metal"));
  EXPECT_EQ(id(Material::mirror), material_from_name("mirror"));
  EXPECT_EQ(id(Material::other), material_from_name("other"));
  EXPECT_EQ(id(Material::painted), material_from_name("painted"));
  EXPECT_EQ(id(Material::paper), material_from_name("paper"));
  EXPECT_EQ(id(Material::plastic), material_from_name("plastic"));
  EXPECT_EQ(id(Material::polishedstone), material_from_name("polishedstone"));
  EXPECT_EQ(id(Material::skin), material_from_name("skin"));
  EXPECT_EQ(id(Material::sky), material_from_name("sky"));
  EXPECT_EQ(id(Material::stone), material_from_name("stone"));
  EXPECT_EQ(id(Material::tile), material_from_name("tile"));
  EXPECT_EQ(id(Material::wallpaper), material_from_name("wallpaper"));
  EXPECT_EQ(id(Material::water), material_from_name("water"));
  EXPECT_EQ(id(Material::wood), material_from_name("wood"));
}

class EveryScene : public testing::TestWithParam<SceneId> {
 protected:
  const Scene sut = make_scene(GetParam());
};
INSTANTIATE_TEST_SUITE_P(Scenes, EveryScene,
                         testing::Values(SceneId::bedroom, SceneId::office, SceneId::wall, SceneId::corner),
                         [](const auto& scene) { return std::string(name(scene.param)); });

TEST_P(EveryScene, DistanceIsTheLeastOfAllSolids) {
  std::mt19937 random(kSeed);
  for (int i = 0; i < 2000; ++i) {
    const Vec3d p = random_point_in(sut, random);
    double least = 1e9;
    for (const Primitive& s : sut.primitives()) least = std::min(least, local_distance(s, s.to_local(p)));
    ASSERT_EQ(sut.distance(p), least) << "seed " << kSeed << ", point " << i;
  }
}

TEST_P(EveryScene, FloatDistanceIsTheDoubleOneRounded) {
  std::mt19937 random(kSeed);
  for (int i = 0; i < 200; ++i) {
    const Vec3f p = random_point_in(sut, random).cast<float>();
    EXPECT_EQ(sut.distance(p), static_cast<float>(sut.distance(p.cast<double>())));
  }
}

TEST_P(EveryScene, NormalLeadsAwayFromTheSurface) {
  std::mt19937 random(kSeed);
  int outside = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vec3d p = random_point_in(sut, random);
    const double d = sut.distance(p);
    if (d < 0.002) continue;
    ++outside;
    const Vec3d n = sut.normal(p);
    ASSERT_NEAR(n.norm(), 1, 1e-9);
    // One step of Newton from outside lands on the surface: the distance is exact.
    const Vec3d foot = p - n * d;
    EXPECT_NEAR(sut.distance(foot), 0, 1e-9) << "seed " << kSeed << ", point " << i;
    EXPECT_EQ(sut.material(foot), sut.material(p));
  }
  EXPECT_GT(outside, 1000);
}

TEST(FurnishedRooms, HaveManyObjectsCurvedAndThin) {
  for (const SceneId id : {SceneId::bedroom, SceneId::office}) {
    const Scene sut = make_scene(id);
    EXPECT_GE(sut.object_names().size(), 20U);
    int curved = 0;
    double thinnest_m = 1;
    for (const Primitive& s : sut.primitives()) {
      curved += s.shape != Shape::box ? 1 : 0;
      thinnest_m = std::min(thinnest_m,
                            std::min(s.half_extents_m.x, std::min(s.half_extents_m.y, s.half_extents_m.z)));
    }
    EXPECT_GE(curved, 60);
    EXPECT_LE(thinnest_m, 0.006);
    EXPECT_GE(thinnest_m, 0.003);
  }
}

TEST(FurnishedRooms, TexturesVaryEnoughToTrack) {
  for (const SceneId id : {SceneId::bedroom, SceneId::office}) {
    const Scene sut = make_scene(id);
    for (const Finish& finish : sut.finishes()) {
      const Texture& texture = sut.textures()[finish.texture];
      int low = 255, high = 0;
      for (int i = 0; i < 1000; ++i) {
        const Rgb8 c =
            texture.sample(0.0137F * static_cast<float>(i % 40), 0.0211F * static_cast<float>(i / 40), 0);
        const int luma = (c.r + 2 * c.g + c.b) / 4;
        low = std::min(low, luma);
        high = std::max(high, luma);
      }
      EXPECT_GE(high - low, 8) << "finish of material " << static_cast<int>(finish.material);
    }
  }
}

TEST(FlatWall, HasOneNormalAndMuchTexture) {
  const Scene sut = make_scene(SceneId::wall);
  EXPECT_EQ(sut.primitives().size(), 1U);
  EXPECT_NEAR(sut.distance(Vec3d{0.3, 1.2, 0}), 1.5, 1e-12);
  EXPECT_EQ(sut.normal({0.3, 1.2, 0}), (Vec3d{0, 0, 1}));
}

}  // namespace
}  // namespace tactus::hal::synthetic
