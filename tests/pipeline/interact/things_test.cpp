#include "pipeline/interact/things.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "tests/rt/aligned_memory.hpp"

namespace tactus::interact {
namespace {

class BoundThings : public testing::Test {
 protected:
  void SetUp() override {
    rt::Slice slice = memory_.slice();
    const auto bound = sut_.bind(slice);
    ASSERT_TRUE(bound.has_value()) << bound.error().message;
    EXPECT_EQ(slice.bytes_left(), 0U);
  }
  test::AlignedMemory memory_{ThingCatalogue::bytes_needed()};
  ThingCatalogue sut_;
};

double pieces_volume_m3(const Thing& thing) {
  double sum = 0;
  for (const Piece& piece : thing.pieces) sum += piece.hull->volume_m3;
  return sum;
}

TEST_F(BoundThings, PiecesOfAPlateFillItButForTheRoundRim) {
  const Thing& plate = sut_.of(ThingKind::plate);
  ASSERT_EQ(plate.pieces.size(), ThingCatalogue::kPiecesCount);
  // A polygon of 16 corners covers 97.4 % of its circle.
  EXPECT_NEAR(pieces_volume_m3(plate) / contact::volume_m3(plate.shape), 0.9745, 0.001);
  Vec3d moment;
  for (const Piece& piece : plate.pieces) moment += piece.offset_m * piece.hull->volume_m3;
  EXPECT_LT(moment.norm() / pieces_volume_m3(plate), 1e-6) << "together they lie where the plate lies";
}

TEST_F(BoundThings, EveryPieceLiesWithinItsThing) {
  for (const ThingKind kind : {ThingKind::plate, ThingKind::cup}) {
    const Thing& thing = sut_.of(kind);
    for (const Piece& piece : thing.pieces)
      for (std::size_t i = 0; i < piece.hull->vertices_count; ++i) {
        const Vec3d p = piece.offset_m + piece.hull->vertex(i);
        EXPECT_LE(std::sqrt(p.x * p.x + p.y * p.y), thing.shape.radius_m + 1e-9);
        EXPECT_LE(std::abs(p.z), thing.shape.half_length_m + 1e-9);
      }
  }
}

TEST_F(BoundThings, OnlyWhatHasWallsBreaks) {
  EXPECT_EQ(sut_.of(ThingKind::plain).build.wall_m, 0);
  EXPECT_TRUE(sut_.of(ThingKind::plain).pieces.empty());
  for (const ThingKind kind : {ThingKind::plate, ThingKind::cup}) {
    const Thing& thing = sut_.of(kind);
    EXPECT_GT(thing.build.wall_m, 0);
    EXPECT_LT(thing.build.volume_m3, contact::volume_m3(thing.shape));
  }
}

TEST_F(BoundThings, HullsAreNumberedInTheirOrder) {
  EXPECT_EQ(sut_.hulls().size(), ThingCatalogue::kHullsCount);
  EXPECT_EQ(sut_.index_of(*sut_.of(ThingKind::plate).pieces[3].hull), 3U);
  EXPECT_EQ(sut_.index_of(sut_.chip(contact::BreakPattern::none)), 2 * ThingCatalogue::kPiecesCount);
}

TEST_F(BoundThings, ChipsAreOneToThreeCentimetresAcrossAndDifferByPattern) {
  double longest = 0, shortest = 1;
  for (const auto pattern : {contact::BreakPattern::shards, contact::BreakPattern::crumbs,
                             contact::BreakPattern::splinters, contact::BreakPattern::fibres}) {
    const double radius = sut_.chip(pattern).radius_m;
    EXPECT_GT(radius, 0.005);
    EXPECT_LT(radius, 0.015);
    longest = std::max(longest, radius);
    shortest = std::min(shortest, radius);
  }
  EXPECT_GT(longest, 1.3 * shortest);
}

}  // namespace
}  // namespace tactus::interact
