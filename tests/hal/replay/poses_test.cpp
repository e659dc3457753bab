#include "hal/replay/poses.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace tactus::hal::replay {
namespace {

TEST(Trajectory, LineBecomesCameraToWorld) {
  // A quarter turn about z: the camera's x axis is the world's y axis.
  const Trajectory sut = parse_trajectory("# t\n1.5 1 2 3 0 0 0.70710678 0.70710678\n", "gt");
  ASSERT_EQ(sut.poses.size(), 1U);
  EXPECT_EQ(sut.poses[0].time.ns, 1500000000);
  const Vec3d p = sut.poses[0].T_world_depth * Vec3d{1, 0, 0};
  EXPECT_NEAR(p.x, 1, 1e-7);
  EXPECT_NEAR(p.y, 3, 1e-7);
  EXPECT_NEAR(p.z, 3, 1e-7);
  EXPECT_EQ(sut.skipped_count, 0U);
}

TEST(Trajectory, UnusableLinesAreSkippedAndCounted) {
  const Trajectory sut = parse_trajectory(
      "0 0 0 0 0 0 0 1\n"
      "1 nan 0 0 0 0 0 1\n"
      "2 0 0 0 0 0 0 0\n"
      "3 0 0 0 0 0 0 1.02\n"
      "4 0 0 0 0 0 0\n"
      "5 0 0 0 0 0 0 1 9\n"
      "garbage\n"
      "0 0 0 0 0 0 0 1\n"
      "6 0 0 0 0 0 0 1e300\n"
      "7 0 0 0 0 0 0 -1.005\n",
      "groundtruth.txt");
  EXPECT_EQ(sut.poses.size(), 2U);
  EXPECT_EQ(sut.skipped_count, 8U);
  EXPECT_EQ(sut.first_skip, "groundtruth.txt:2: needs 8 finite numbers: timestamp tx ty tz qx qy qz qw");
}

TEST(Trajectory, TimesIncreaseWhateverTheFileSays) {
  const Trajectory sut =
      parse_trajectory("1 0 0 0 0 0 0 1\n99 0 0 0 0 0 0 1\n2 0 0 0 0 0 0 1\n3 0 0 0 0 0 0 1\n", "gt");
  ASSERT_EQ(sut.poses.size(), 3U);
  EXPECT_EQ(sut.poses[1].time.ns, 2000000000);
  EXPECT_EQ(sut.first_skip, "gt:2: the time does not fit between its neighbours'");
}

TEST(PoseMatrix, ReadsRowMajorAndMakesOrthonormal) {
  auto sut = parse_pose_matrix("0 -1.001 0 4\n1 0 0 5\n0 0 1 6\n0 0 0 1\n", "p");
  ASSERT_TRUE(sut.has_value());
  EXPECT_TRUE(is_rotation(sut->rotation, 1e-12));
  EXPECT_NEAR((*sut * Vec3d{1, 0, 0}).y, 6, 1e-3);
  EXPECT_EQ(sut->translation, (Vec3d{4, 5, 6}));
}

TEST(PoseMatrix, WhatIsNoRigidMotionIsRefused) {
  const auto message = [](const char* text) {
    auto pose = parse_pose_matrix(text, "frame-000007.pose.txt");
    return pose ? std::string("accepted") : pose.error().message;
  };
  EXPECT_EQ(message("1 0 0 0 0 1 0 0 0 0 1 0"),
            "frame-000007.pose.txt: has 12 numbers; a 4x4 camera-to-world matrix has 16");
  EXPECT_EQ(message("1 0 0 0\n0 1 0 nan\n0 0 1 0\n0 0 0 1"),
            "frame-000007.pose.txt:2: \"nan\" is not a finite number");
  EXPECT_EQ(message("1 0 0 0 0 1 0 0 0 0 -1 0 0 0 0 1"),
            "frame-000007.pose.txt: the upper left 3x3 of the matrix is not a rotation");
  EXPECT_EQ(message("2 0 0 0 0 2 0 0 0 0 2 0 0 0 0 1"),
            "frame-000007.pose.txt: the upper left 3x3 of the matrix is not a rotation");
  EXPECT_EQ(message("1 0 0 0 0 1 0 0 0 0 1 0 0 0 1 1"),
            "frame-000007.pose.txt: the last row of the matrix is not 0 0 0 1");
  EXPECT_EQ(message("1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1 7"),
            "frame-000007.pose.txt:1: more than the 16 numbers of a 4x4 matrix");
}

}  // namespace
}  // namespace tactus::hal::replay
