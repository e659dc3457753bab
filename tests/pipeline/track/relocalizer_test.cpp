#include "pipeline/track/relocalizer.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

#include "pipeline/register/half_color.hpp"
#include "tests/pipeline/track/plane_room.hpp"

namespace tactus::track {
namespace {

using test::half_camera;

class OwnedRelocalizer {
 public:
  explicit OwnedRelocalizer(std::uint32_t keyframes_capacity) {
    const RelocalizerConfig config{.keyframes_capacity = keyframes_capacity};
    const std::size_t bytes = rt::round_up(Relocalizer::bytes_needed(config), 64);
    memory_.reset(static_cast<std::byte*>(std::aligned_alloc(64, bytes)));
    rt::Slice slice({memory_.get(), bytes});
    sut.bind(slice, config);
  }
  Relocalizer sut;

 private:
  struct Free {
    void operator()(std::byte* p) const { std::free(p); }
  };
  std::unique_ptr<std::byte, Free> memory_;
};

T_WorldDepth at(double x) { return {{}, {x, 0, 0}}; }

// A slanted plane per number: depth images that differ.
std::vector<float> picture(int number) {
  return test::live_view(
      {test::plane_through({0, 0, 1.0 + 0.35 * number}, {0.3 - 0.1 * number, 0.1 * number - 0.2, -1})}, {});
}

std::vector<std::uint32_t> gray(std::size_t count, std::uint32_t level) {
  return std::vector<std::uint32_t>(count, level | level << 8 | level << 16 | 0xFF000000u);
}

void observe(Relocalizer& sut, const std::vector<float>& half_m) { sut.observe(half_m, {}, half_camera()); }

std::set<double> stored_xs(Relocalizer& sut) {
  std::set<double> xs;
  for (const auto& proposal : sut.propose()) xs.insert(proposal.T_world_depth.translation.x);
  return xs;
}

TEST(Relocalizer, ProposesTheKeyframeThatLooksTheSameFirst) {
  OwnedRelocalizer owned(16);
  Relocalizer& sut = owned.sut;
  for (int i = 0; i < 8; ++i) {
    observe(sut, picture(i));
    sut.remember(at(i));
  }
  ASSERT_EQ(sut.keyframes_count(), 8U);
  std::mt19937 random(1);
  std::uniform_real_distribution<float> noise(-0.02f, 0.02f);
  for (int i = 0; i < 8; ++i) {
    auto seen = picture(i);
    for (float& z : seen) z = random() % 5 == 0 ? 0.0f : z + noise(random);
    observe(sut, seen);
    const auto proposals = sut.propose();
    ASSERT_EQ(proposals.size(), static_cast<std::size_t>(Relocalizer::kProposalsMax));
    EXPECT_EQ(proposals[0].T_world_depth.translation.x, i);
    EXPECT_TRUE(std::is_sorted(proposals.begin(), proposals.end(),
                               [](const auto& a, const auto& b) { return a.difference < b.difference; }));
  }
}

TEST(Relocalizer, IdenticalFrameDiffersByNothing) {
  OwnedRelocalizer owned(4);
  observe(owned.sut, picture(2));
  owned.sut.remember(at(0));
  ASSERT_EQ(owned.sut.propose().size(), 1U);
  EXPECT_EQ(owned.sut.propose()[0].difference, 0.0f);
}

TEST(Relocalizer, BrightnessTellsEqualShapesApart) {
  OwnedRelocalizer owned(4);
  const auto shape = picture(3);
  for (std::uint32_t i = 0; i < 3; ++i) {
    owned.sut.observe(shape, gray(shape.size(), 40 + 80 * i), half_camera());
    owned.sut.remember(at(i));
  }
  for (std::uint32_t i = 0; i < 3; ++i) {
    owned.sut.observe(shape, gray(shape.size(), 35 + 80 * i), half_camera());
    ASSERT_FALSE(owned.sut.propose().empty());
    EXPECT_EQ(owned.sut.propose()[0].T_world_depth.translation.x, i);
  }
}

TEST(Relocalizer, NearPosesAreNotStoredTwice) {
  OwnedRelocalizer owned(8);
  observe(owned.sut, picture(0));
  owned.sut.remember(at(0));
  owned.sut.remember(at(0.29));
  EXPECT_EQ(owned.sut.keyframes_count(), 1U);
  owned.sut.remember(at(0.31));
  EXPECT_EQ(owned.sut.keyframes_count(), 2U);
  T_WorldDepth turned = at(0);
  turned.rotation = test::motion({0, 0.5, 0}, {}).rotation;
  owned.sut.remember(turned);
  EXPECT_EQ(owned.sut.keyframes_count(), 3U);
}

TEST(Relocalizer, FullStoreGivesUpTheMostCrowdedKeyframe) {
  OwnedRelocalizer owned(4);
  Relocalizer& sut = owned.sut;
  const double xs[] = {0, 2, 2.4, 5};
  for (int i = 0; i < 4; ++i) {
    observe(sut, picture(i));
    sut.remember(at(xs[i]));
  }
  observe(sut, picture(4));
  sut.remember(at(8));
  EXPECT_EQ(sut.keyframes_count(), 4U);
  EXPECT_EQ(stored_xs(sut), (std::set<double>{0, 2, 5, 8}));
  ASSERT_FALSE(sut.propose().empty());
  EXPECT_EQ(sut.propose()[0].T_world_depth.translation.x, 8) << "with the picture that was seen there";
  // Farther from all than the store's own nearest pair: it would not spread better.
  sut.remember(at(9.5));
  EXPECT_EQ(stored_xs(sut), (std::set<double>{0, 2, 5, 8}));
}

TEST(Relocalizer, BlankFrameProposesNothing) {
  OwnedRelocalizer owned(4);
  observe(owned.sut, picture(0));
  owned.sut.remember(at(0));
  observe(owned.sut, std::vector<float>(picture(0).size(), 0.0f));
  EXPECT_TRUE(owned.sut.propose().empty());
}

TEST(Relocalizer, EmptyStoreProposesNothing) {
  OwnedRelocalizer owned(4);
  observe(owned.sut, picture(0));
  EXPECT_TRUE(owned.sut.propose().empty());
}

}  // namespace
}  // namespace tactus::track
