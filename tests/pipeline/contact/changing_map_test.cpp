// The map changes under bodies that rest on it: it rises, sinks, tilts, loses a block.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "pipeline/contact/world.hpp"
#include "tests/pipeline/contact/analytic_field.hpp"
#include "tests/pipeline/contact/test_shapes.hpp"

namespace tactus::contact {
namespace {

/// A floor that tests lift and tilt, and take a block from.
struct Ground {
  double height_m = 0, slope = 0;
  bool hole = false;

  [[nodiscard]] double operator()(const Vec3d& p) const {
    const double n = std::sqrt(1 + slope * slope);
    return (p.y - height_m - slope * p.x) / n;
  }
};

class ChangingMap : public testing::Test {
 protected:
  ChangingMap() : scene_(Distance{&ground_}), sut_(field()) {
    std::mt19937 random(17);
    for (int i = 0; i < 50; ++i) {
      BodySpec spec;
      spec.shape = test::small_shape(i, random);
      // Apart: what one of them does is the map's doing.
      spec.position_world_m = {0.15 * (i % 10) - 0.7, reach_m(spec.shape) + 0.01, 0.15 * (i / 10) - 0.3};
      ids_.push_back(sut_.spawn(spec));
    }
    sut_.run(6);
  }

  /// Runs, watching for the fastest and the highest.
  void watch(double seconds) {
    const auto before = states();
    for (int i = 0; i < static_cast<int>(seconds * kStepsPerSecond); ++i) {
      sut_.run_step();
      for (std::size_t b = 0; b < ids_.size(); ++b) {
        const BodyState* state = sut_.find(ids_[b]);
        ASSERT_NE(state, nullptr) << "body " << b << " left the world";
        const Vec3d& p = state->position_world_m;
        top_speed_ = std::max(top_speed_, state->velocity_world_m_per_s.norm());
        highest_m_ = std::max(highest_m_, ground_(p) - reach_m(state->shape));
        lifted_m_ = std::max(lifted_m_, p.y - before[b].position_world_m.y);
      }
    }
  }
  std::vector<BodyState> states() {
    std::vector<BodyState> result;
    for (const BodyId id : ids_) result.push_back(*sut_.find(id));
    return result;
  }
  int resting() {
    int count = 0;
    for (const BodyState& state : states()) count += state.resting ? 1 : 0;
    return count;
  }
  void expect_above_the_ground() {
    for (const BodyState& state : states()) EXPECT_GT(ground_(state.position_world_m), 0.005) << static_cast<int>(state.shape.kind);
  }

 private:
  /// The scene, with a block of 8 cm under some of the bodies missing on demand.
  DistanceField field() {
    DistanceField f;
    f.context = this;
    f.truncation_m = 0.04F;
    f.sample_fn = [](const void* context, const Vec3f& p, map::DistanceSample& out) noexcept {
      const auto& self = *static_cast<const ChangingMap*>(context);
      const bool evicted = self.ground_.hole && std::abs(p.x) < 0.24F && std::abs(p.z) < 0.24F;
      return !evicted && self.scene_.field().sample(p.cast<double>(), out);
    };
    f.materials_fn = [](const void* context, const Vec3f& p, MaterialDistribution& out) noexcept {
      return static_cast<const ChangingMap*>(context)->scene_.field().materials(p.cast<double>(), out);
    };
    return f;
  }

 protected:
  Ground ground_;

 private:
  struct Distance {
    const Ground* ground;
    double operator()(const Vec3d& p) const { return (*ground)(p); }
  };
  test::AnalyticField<Distance> scene_;

 protected:
  test::BoundWorld sut_;
  std::vector<BodyId> ids_;
  double top_speed_ = 0, highest_m_ = 0, lifted_m_ = 0;
};

// The solver eases bodies out at 1 m/s at most; a tenth more for what gravity and neighbours add.
constexpr double kSpeedMax = 1.1;
constexpr double kEjectedMaxM = 0.05;

TEST_F(ChangingMap, SurfaceThatRisesEasesBodiesUp) {
  for (const double rise_m : {0.005, 0.01, 0.02}) {
    ground_.height_m += rise_m;
    watch(3);
    EXPECT_LT(top_speed_, kSpeedMax) << rise_m;
    EXPECT_LT(highest_m_, kEjectedMaxM) << rise_m;
  }
  expect_above_the_ground();
  EXPECT_GE(resting(), 45);
}

TEST_F(ChangingMap, SurfaceThatSinksLetsBodiesDown) {
  for (const double drop_m : {0.005, 0.01, 0.02}) {
    ground_.height_m -= drop_m;
    watch(3);
    EXPECT_LT(top_speed_, kSpeedMax) << drop_m;
    EXPECT_LT(lifted_m_, 0.005) << "none is thrown up";
  }
  expect_above_the_ground();
  EXPECT_GE(resting(), 45);
}

TEST_F(ChangingMap, SurfaceThatTremblesKeepsThem) {
  // A map that is refined: half a centimetre up and down, ten times a second.
  for (int i = 0; i < 40; ++i) {
    ground_.height_m = i % 2 == 0 ? 0.005 : 0;
    watch(0.1);
  }
  ground_.height_m = 0;
  watch(4);
  EXPECT_LT(top_speed_, kSpeedMax);
  EXPECT_LT(highest_m_, kEjectedMaxM);
  expect_above_the_ground();
  EXPECT_GE(resting(), 45);
}

TEST_F(ChangingMap, FloorThatTiltsNeitherThrowsNorSwallows) {
  // Up to 2 cm at the rim, 0.8 m from the axis, and a little more where some have rolled.
  for (const double slope : {0.02, 0.035, 0.015, -0.005}) {
    ground_.slope = slope;
    watch(1);
    EXPECT_LT(highest_m_, kEjectedMaxM) << slope;
  }
  watch(3);
  expect_above_the_ground();
  EXPECT_LT(top_speed_, kSpeedMax);
}

TEST_F(ChangingMap, EvictedBlockLeavesItsSleepersWhereTheyAre) {
  ASSERT_EQ(resting(), 50);
  const auto before = states();
  ground_.hole = true;
  watch(3);
  ground_.hole = false;
  watch(2);
  const auto after = states();
  EXPECT_LT(top_speed_, kSpeedMax);
  for (std::size_t i = 0; i < after.size(); ++i)
    EXPECT_LT((after[i].position_world_m - before[i].position_world_m).norm(), 0.002) << i;
}

}  // namespace
}  // namespace tactus::contact
