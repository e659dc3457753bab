// Queries of the map against shapes whose distance is known in closed form.
#include "pipeline/map/reader.hpp"

#include <gtest/gtest.h>

#include <random>

#include "tests/pipeline/map/fusion.hpp"

namespace tactus::map {
namespace {

using test::FusedMap;
using test::OwnedMap;
using test::RegisteredFrame;

const Vec3d kCentre{0.013, -0.021, 0.008};
constexpr double kRadius = 0.2;
double sphere_distance(const Vec3d& p) { return (p - kCentre).norm() - kRadius; }

class ReaderOfASphere : public testing::Test {
 protected:
  ReaderOfASphere() { test::fill(owned_.map, {-0.3, -0.3, -0.3}, {0.3, 0.3, 0.3}, sphere_distance); }
  Vec3d direction() {
    Vec3d d;
    do d = {uniform_(random_), uniform_(random_), uniform_(random_)};
    while (d.norm() < 0.1 || d.norm() > 1);
    return d.normalized();
  }
  OwnedMap owned_{{0.01f, 0.04f, 2048}};
  Reader sut{owned_.map};
  std::mt19937_64 random_{11};
  std::uniform_real_distribution<double> uniform_{-1, 1};
};

TEST_F(ReaderOfASphere, SampleIsTheDistanceAndItsGradient) {
  double worst_m = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vec3d d = direction();
    const double off = uniform_(random_) * 0.02;
    DistanceSample sample;
    ASSERT_TRUE(sut.sample((kCentre + d * (kRadius + off)).cast<float>(), sample));
    worst_m = std::max(worst_m, std::fabs(static_cast<double>(sample.distance_m) - off));
    EXPECT_GT(sample.gradient.cast<double>().dot(d), 0.998);
    EXPECT_NEAR(sample.gradient.norm(), 1, 1e-5);
    float distance_m = 0;
    ASSERT_TRUE(sut.distance((kCentre + d * (kRadius + off)).cast<float>(), distance_m));
    EXPECT_EQ(distance_m, sample.distance_m);
  }
  // Trilinear reads of a sphere: h^2 / 4R = 0.13 mm of sag at most.
  EXPECT_LT(worst_m, 0.00025);
}

TEST_F(ReaderOfASphere, DistancesOfManyPointsAreThoseOfEach) {
  std::array<Vec3f, 300> points;
  for (Vec3f& p : points) p = (kCentre + direction() * (kRadius + uniform_(random_) * 0.2)).cast<float>();
  points[7] = {NAN, 0, 0};
  std::array<float, 300> distances_m;
  sut.distances(points, distances_m);
  int known_count = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    float distance_m = kUnknownDistanceM;
    known_count += sut.distance(points[i], distance_m) ? 1 : 0;
    EXPECT_EQ(distances_m[i], distance_m) << i;
  }
  EXPECT_GT(known_count, 50);
  EXPECT_LT(known_count, 290);
}

TEST_F(ReaderOfASphere, RaysHitWhereTheyMust) {
  int hits_count = 0;
  for (int i = 0; i < 1000; ++i) {
    const Vec3d from = kCentre + direction() * 0.9;
    const Vec3d towards = kCentre + direction() * (kRadius * 0.8);
    const Vec3d d = (towards - from).normalized();
    const double along = (kCentre - from).dot(d);
    const double half_chord2 = kRadius * kRadius - ((kCentre - from).dot(kCentre - from) - along * along);
    ASSERT_GT(half_chord2, 0);
    const Vec3d expected = from + d * (along - std::sqrt(half_chord2));
    SurfacePoint hit;
    ASSERT_TRUE(sut.raycast(from.cast<float>(), (d * 3.0).cast<float>(), 2, hit)) << "ray " << i;
    ++hits_count;
    EXPECT_LT((hit.position_world_m.cast<double>() - expected).norm(), 0.001) << "ray " << i;
    EXPECT_GT(hit.normal_world.cast<double>().dot((expected - kCentre).normalized()), 0.995);
    EXPECT_EQ(hit.color.r, 100);
    EXPECT_EQ(hit.material, kUnknownMaterial);
    EXPECT_EQ(hit.label_observations, 0);
  }
  EXPECT_EQ(hits_count, 1000);
}

TEST_F(ReaderOfASphere, RaysPastItOrTooShortOrOfNoDirectionHitNothing) {
  SurfacePoint hit;
  for (int i = 0; i < 500; ++i) {
    const Vec3d from = kCentre + direction() * 0.9;
    const Vec3d side = (from - kCentre).cross(direction()).normalized();
    const Vec3d past = kCentre + side * (kRadius + 0.012);
    // The nearest point of the ray to the centre is farther than the radius.
    const Vec3d d = (past - from).normalized();
    const double nearest = (from - kCentre + d * (kCentre - from).dot(d)).norm();
    if (nearest < kRadius + 0.002) continue;
    EXPECT_FALSE(sut.raycast(from.cast<float>(), d.cast<float>(), 3, hit)) << "ray " << i;
    EXPECT_FALSE(sut.raycast(from.cast<float>(), (kCentre - from).cast<float>(), 0.6f, hit)) << "ray " << i;
  }
  EXPECT_FALSE(sut.raycast({0.9f, 0, 0}, {0, 0, 0}, 3, hit));
}

TEST_F(ReaderOfASphere, NearestSurfaceIsRadial) {
  for (int i = 0; i < 1000; ++i) {
    const Vec3d d = direction();
    SurfacePoint found;
    ASSERT_TRUE(
        sut.nearest_surface((kCentre + d * (kRadius + uniform_(random_) * 0.025)).cast<float>(), found))
        << i;
    EXPECT_LT((found.position_world_m.cast<double>() - kCentre - d * kRadius).norm(), 0.002) << i;
    EXPECT_GT(found.normal_world.cast<double>().dot(d), 0.995) << i;
  }
}

TEST_F(ReaderOfASphere, FarFromItNothingIsKnown) {
  DistanceSample sample;
  SurfacePoint found;
  float distance_m = 0;
  for (const Vec3f p :
       {Vec3f{1, 1, 1}, Vec3f{-50, 0, 0}, Vec3f{1e9f, 0, 0}, Vec3f{0, -1e30f, 0}, Vec3f{NAN, 0, 0}}) {
    EXPECT_FALSE(sut.sample(p, sample)) << p.x;
    EXPECT_FALSE(sut.distance(p, distance_m)) << p.x;
    EXPECT_FALSE(sut.nearest_surface(p, found)) << p.x;
  }
  EXPECT_FALSE(sut.sample(kCentre.cast<float>(), sample)) << "deep inside nothing was observed";
}

// Half of the sphere was never seen: it is not solid, and no surface.
TEST(Reader, UnseenHalfIsUnknown) {
  OwnedMap owned({0.01f, 0.04f, 2048});
  test::fill(owned.map, {-0.3, -0.3, -0.3}, {0.3, 0.3, 0.3}, sphere_distance,
             [](const Vec3d& p) { return p.z < kCentre.z; });
  const Reader sut(owned.map);
  SurfacePoint hit;
  EXPECT_TRUE(sut.raycast({0, 0, -1}, {0, 0, 1}, 3, hit));
  EXPECT_FALSE(sut.raycast({0, 0, 1}, {0, 0, -1}, 3, hit)) << "seen from behind, the front is no surface";
  float distance_m = 0;
  EXPECT_FALSE(sut.distance((kCentre + Vec3d{0, 0, kRadius}).cast<float>(), distance_m));
}

// A ball before a wall, from seven views without noise. Projective distances are not Euclidean ones: near the
// surface they agree.
TEST(Reader, FusedBallIsWhereItWas) {
  const Vec3d centre{0.05, -0.03, 1.4};
  constexpr double kBallRadius = 0.25, kWall = 2.0;
  FusedMap fused;
  RegisteredFrame frame(test::small_camera());
  std::uint32_t index = 0;
  for (const Vec3d& at : {Vec3d{0, 0, 0}, Vec3d{0.2, 0, 0}, Vec3d{-0.2, 0, 0}, Vec3d{0, 0.15, 0},
                          Vec3d{0, -0.15, 0}, Vec3d{0.1, 0.1, 0.1}, Vec3d{-0.1, -0.1, -0.1}}) {
    frame.measure([&](double a, double b) {
      const Vec3d d{a, b, 1};
      const double dd = d.dot(d), dc = d.dot(centre - at);
      const double root = dc * dc - dd * ((centre - at).dot(centre - at) - kBallRadius * kBallRadius);
      return root > 0 ? (dc - std::sqrt(root)) / dd : kWall - at.z;
    });
    const T_WorldDepth T_world_depth{{}, at};
    for (int i = 0; i < 3; ++i) fused.fuse(frame.at(T_world_depth, ++index));
  }
  const Reader sut(fused.map());
  double sum_m = 0, worst_m = 0;
  int count = 0;
  for (double a = -0.16; a <= 0.16; a += 0.01)
    for (double b = -0.16; b <= 0.16; b += 0.01) {
      const Vec3d d{centre.x / centre.z + a, centre.y / centre.z + b, 1};
      const double dc = d.dot(centre), dd = d.dot(d);
      const double root = dc * dc - dd * (centre.dot(centre) - kBallRadius * kBallRadius * 0.8);
      if (root < 0) continue;  // the rim is seen at glancing angles only
      SurfacePoint hit;
      ASSERT_TRUE(sut.raycast({0, 0, 0}, d.cast<float>(), 3, hit)) << a << ' ' << b;
      const double error = std::fabs((hit.position_world_m.cast<double>() - centre).norm() - kBallRadius);
      sum_m += error;
      worst_m = std::max(worst_m, error);
      ++count;
    }
  ASSERT_GT(count, 200);
  EXPECT_LT(sum_m / count, 0.0006);
  EXPECT_LT(worst_m, 0.003);
  SurfacePoint wall;
  ASSERT_TRUE(sut.raycast({0, 0, 0}, {0.4f, 0.3f, 1}, 4, wall));
  EXPECT_NEAR(wall.position_world_m.z, kWall, 0.0005);
}

}  // namespace
}  // namespace tactus::map
