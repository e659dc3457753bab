#include "pipeline/label_survey.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "pipeline/register/half_color.hpp"
#include "tests/pipeline/label_survey/wall_view.hpp"

namespace tactus {
namespace {

using test::kWallZ;
using test::WallView;

constexpr auto kAnywhere = [](const Vec3d&) { return true; };
constexpr auto kOnTheLeft = [](const Vec3d& p) { return p.x < 0; };

/// The wall fills the image; the outermost rays lack the neighbours that normals are fitted from.
constexpr std::size_t kWholeWall = kSurveySamples;

TEST(LabelSurvey, WallWithoutLabelsIsAllNew) {
  WallView wall;
  const LabelSurvey sut = survey_labels(wall.input(5));
  EXPECT_EQ(sut.surface_count, kWholeWall);
  EXPECT_EQ(sut.unlabelled_count, kWholeWall);
  EXPECT_EQ(sut.new_count, kWholeWall);
  EXPECT_EQ(sut.weak_count, 0u);
  EXPECT_EQ(sut.old_count, 0u);
  EXPECT_EQ(sut.share(sut.new_count), 1.0f);
  EXPECT_FALSE(sut.moved_half_px.has_value());
}

TEST(LabelSurvey, HalfLabelledWallIsHalfNew) {
  WallView wall;
  wall.label(kOnTheLeft, 3, 100);
  const LabelSurvey sut = survey_labels(wall.input(130));
  EXPECT_EQ(sut.surface_count, kWholeWall);
  EXPECT_EQ(sut.unlabelled_count, kWholeWall / 2) << "the image's middle lies between two columns of rays";
  EXPECT_EQ(sut.new_count, kWholeWall / 2) << "the blocks on the right were never labelled";
  EXPECT_EQ(sut.weak_count, 0u);
  EXPECT_EQ(sut.label_age_frames_sum, 30u * (kWholeWall / 2));
}

TEST(LabelSurvey, FewObservationsAreWeakAndLongAgoIsOld) {
  WallView wall;
  wall.label(kAnywhere, 2, 100);
  EXPECT_EQ(survey_labels(wall.input(399)).weak_count, kWholeWall);
  EXPECT_EQ(survey_labels(wall.input(399)).old_count, 0u);
  EXPECT_EQ(survey_labels(wall.input(400)).old_count, kWholeWall);
  wall.label(kOnTheLeft, 3, 200);
  EXPECT_EQ(survey_labels(wall.input(400)).weak_count, kWholeWall / 2);
  EXPECT_EQ(survey_labels(wall.input(400)).old_count, kWholeWall / 2);
}

TEST(LabelSurvey, CellsThatAKeyframeLeftOutAreNotNewForAWhile) {
  WallView wall;
  // Every second cell of every block: the block is labelled, half of its cells are not.
  wall.label([](const Vec3d& p) { return std::lround(p.x / 0.02) % 2 == 0; }, 3, 100);
  const LabelSurvey soon = survey_labels(wall.input(189)), later = survey_labels(wall.input(190));
  EXPECT_GT(soon.unlabelled_count, kWholeWall / 4);
  EXPECT_EQ(soon.new_count, 0u);
  EXPECT_EQ(later.unlabelled_count, soon.unlabelled_count);
  EXPECT_EQ(later.new_count, later.unlabelled_count);
}

TEST(LabelSurvey, WhatAKeyframeUnderWayHasSeenCountsAsLabelledOnce) {
  WallView wall;
  // It stood so far to the left that its right edge is our middle; and behind it the wall was nearer.
  T_WorldDepth to_the_left;
  to_the_left.translation.x = -160.0 / 262.5 * kWallZ;
  const std::vector<float> depth_m = wall.half_depth_m,
                           nearer_m(depth_m.size(), static_cast<float>(kWallZ) - 0.2f);
  LabelSurveyInput input = wall.input(5);
  const KeyframeUnderWay one[] = {{to_the_left, depth_m}};
  input.under_way = one;
  const LabelSurvey half = survey_labels(input);
  EXPECT_EQ(half.new_count, kWholeWall / 2);
  EXPECT_EQ(half.unlabelled_count, kWholeWall) << "it is not in the map yet";
  EXPECT_EQ(half.weak_count, kWholeWall / 2) << "one observation will be too few";

  const KeyframeUnderWay three[] = {{to_the_left, depth_m}, {to_the_left, depth_m}, {to_the_left, depth_m}};
  input.under_way = three;
  EXPECT_EQ(survey_labels(input).weak_count, 0u);
  const KeyframeUnderWay something_nearer[] = {{to_the_left, nearer_m}};
  input.under_way = something_nearer;
  EXPECT_EQ(survey_labels(input).new_count, kWholeWall) << "it saw something that hid the wall";

  wall.label(kAnywhere, 1, 1);
  LabelSurveyInput later = wall.input(400);
  later.under_way = one;
  EXPECT_EQ(survey_labels(later).old_count, kWholeWall / 2);
}

TEST(LabelSurvey, MotionIsTheWayOfTheSurfaceThroughTheImage) {
  WallView wall;
  T_WorldDepth before;
  before.translation = {0.01, -0.02, 0};  // sideways: f * shift / depth
  LabelSurveyInput input = wall.input(5);
  input.T_world_before = before;
  const LabelSurvey moved = survey_labels(input);
  ASSERT_TRUE(moved.moved_half_px.has_value());
  EXPECT_NEAR(*moved.moved_half_px, 262.5 * std::sqrt(5e-4) / kWallZ, 0.01);
  EXPECT_FALSE(moved.moved_since_keyframe_half_px.has_value());

  // A turn of 0.02 rad about the line of sight's vertical: f * angle in the middle, a little more outside.
  const double angle = 0.02;
  T_WorldDepth turned;
  turned.rotation = Rotation::from({std::cos(angle / 2), 0, std::sin(angle / 2), 0});
  input.T_world_before.reset();
  input.T_world_keyframe = turned;
  const LabelSurvey since = survey_labels(input);
  ASSERT_TRUE(since.moved_since_keyframe_half_px.has_value());
  // Oracle: the mean over the image of the turn's flow, f (1 + x^2) angle and f x y angle.
  double sum = 0;
  for (int i = 0; i < 200; ++i)
    for (int j = 0; j < 200; ++j) {
      const double x = (i - 99.5) / 200 * 320 / 262.5, y = (j - 99.5) / 200 * 240 / 262.5;
      sum += 262.5 * angle * std::sqrt((1 + x * x) * (1 + x * x) + x * y * x * y);
    }
  EXPECT_NEAR(*since.moved_since_keyframe_half_px, sum / 40000, 0.05);

  T_WorldDepth behind;
  behind.rotation = Rotation::from({0, 0, 1, 0});
  input.T_world_keyframe = behind;
  EXPECT_EQ(survey_labels(input).moved_since_keyframe_half_px, 320.0f) << "at most the image's width";
}

TEST(LabelSurvey, OnlyWhatAKeyframeCouldLabelIsSurface) {
  WallView wall;
  std::vector<std::uint32_t> color_pixels(wall.half_depth_m.size(), 0);
  for (std::size_t i = 0; i < color_pixels.size(); ++i)
    if (i % 320 < 80) color_pixels[i] = kNoColorPixel;
  LabelSurveyInput input = wall.input(5);
  input.color_pixels = color_pixels;
  EXPECT_EQ(survey_labels(input).surface_count, kWholeWall * 3 / 4);

  // A view that holds little is measured against a quarter of the image.
  for (std::size_t i = 0; i < color_pixels.size(); ++i)
    color_pixels[i] = i % 320 < 32 && i / 320 < 32 ? 0 : kNoColorPixel;
  const LabelSurvey corner = survey_labels(input);
  EXPECT_EQ(corner.new_count, 4u);
  EXPECT_EQ(corner.share(corner.new_count), 4.0f / kSurveySurfaceMin);

  // Normals that look away are no surface to label.
  input.color_pixels = {};
  for (std::size_t i = 0; i < color_pixels.size(); ++i) {
    wall.model.nx[i] = 1;
    wall.model.nz[i] = 0;
  }
  EXPECT_LT(survey_labels(input).surface_count, kWholeWall / 2);
}

}  // namespace
}  // namespace tactus
