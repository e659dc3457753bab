#include "pipeline/evaluate/trajectory.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>

#include "pipeline/evaluate/text.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tactus::evaluate {
namespace {

StampedPose pose_at(double seconds, Vec3d position, Rotation rotation = {}) {
  return {{std::llround(seconds * 1e9)}, {rotation, position}};
}

Rotation about_y(double degrees) {
  const double a = degrees * std::numbers::pi / 180;
  return Rotation::from({std::cos(a / 2), 0, std::sin(a / 2), 0});
}

Rotation random_rotation(std::mt19937& random) {
  std::normal_distribution<double> normal;
  return Rotation::from(
      Quaternion{normal(random), normal(random), normal(random), normal(random)}.normalized());
}

std::vector<PosePair> pairs_of(const std::vector<StampedPose>& estimate,
                               const std::vector<StampedPose>& truth) {
  return associate(estimate, truth);
}

TEST(Associate, PartnersBeyondTheGapAreLeftOut) {
  const std::vector<StampedPose> truth = {pose_at(0.000, {}), pose_at(0.100, {}), pose_at(0.200, {})};
  const std::vector<StampedPose> estimate = {pose_at(0.019, {}), pose_at(0.079, {}), pose_at(0.221, {})};
  const auto pairs = pairs_of(estimate, truth);
  ASSERT_EQ(pairs.size(), 1u);
  EXPECT_EQ(pairs[0].truth.time.ns, 0);
}

TEST(Associate, GapOfExactlyTheLimitIsAPartner) {
  EXPECT_EQ(pairs_of({pose_at(0.020, {})}, {pose_at(0, {})}).size(), 1u);
  EXPECT_EQ(pairs_of({{{20'000'001}, {}}}, {pose_at(0, {})}).size(), 0u);
}

TEST(Associate, CloserOfTwoClaimsWinsWhicheverComesFirst) {
  const std::vector<StampedPose> truth = {pose_at(1.000, {})};
  const auto later = pairs_of({pose_at(0.990, {1, 0, 0}), pose_at(1.002, {2, 0, 0})}, truth);
  ASSERT_EQ(later.size(), 1u);
  EXPECT_EQ(later[0].estimate.T_world_depth.translation.x, 2);
  const auto earlier = pairs_of({pose_at(0.998, {1, 0, 0}), pose_at(1.010, {2, 0, 0})}, truth);
  ASSERT_EQ(earlier.size(), 1u);
  EXPECT_EQ(earlier[0].estimate.T_world_depth.translation.x, 1);
}

TEST(Associate, EmptyInputsGiveNoPairs) {
  EXPECT_TRUE(pairs_of({}, {pose_at(0, {})}).empty());
  EXPECT_TRUE(pairs_of({pose_at(0, {})}, {}).empty());
}

TEST(AbsoluteError, HandComputedCase) {
  // Aligned at the first pose the errors are 0, 3, 4 and 0 cm: rmse = sqrt(25 / 4) = 2.5 cm, mean 1.75,
  // median 1.5.
  const std::vector<StampedPose> truth = {pose_at(0, {0, 0, 0}), pose_at(1, {1, 0, 0}), pose_at(2, {1, 1, 0}),
                                          pose_at(3, {0, 1, 0})};
  const std::vector<StampedPose> estimate = {pose_at(0, {5, 0, 0}), pose_at(1, {6, 0.03, 0}),
                                             pose_at(2, {6, 1, 0.04}), pose_at(3, {5, 1, 0})};
  const auto pairs = pairs_of(estimate, truth);
  const ErrorStatistics e = absolute_error(pairs, align_first_pose(pairs));
  EXPECT_EQ(e.count, 4u);
  EXPECT_NEAR(e.rmse, 0.025, 1e-12);
  EXPECT_NEAR(e.mean, 0.0175, 1e-12);
  EXPECT_NEAR(e.median, 0.015, 1e-12);
  EXPECT_NEAR(e.p95, 0.04, 1e-12);
  EXPECT_NEAR(e.max, 0.04, 1e-12);
}

TEST(AbsoluteError, FirstPoseAlignmentTurnsWithTheFirstRotation) {
  // The estimate's world is turned by 90 degrees about y; without the rotation of the first pose the error
  // would be 1.4 m.
  const std::vector<StampedPose> truth = {pose_at(0, {0, 0, 0}), pose_at(1, {1, 0, 0}),
                                          pose_at(2, {2, 0, 0})};
  const Rotation turn = about_y(90);
  std::vector<StampedPose> estimate;
  for (const StampedPose& t : truth) {
    estimate.push_back({t.time, {turn * t.T_world_depth.rotation, turn * t.T_world_depth.translation}});
  }
  const auto pairs = pairs_of(estimate, truth);
  EXPECT_LT(absolute_error(pairs, align_first_pose(pairs)).max, 1e-12);
}

TEST(AlignRigid, UndoesAnyRigidMotionToRounding) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> metres(-3, 3);
  for (int round = 0; round < 50; ++round) {
    const T_WorldDepth motion{random_rotation(random), {metres(random), metres(random), metres(random)}};
    std::vector<StampedPose> truth, estimate;
    for (int i = 0; i < 20; ++i) {
      const T_WorldDepth t{random_rotation(random), {metres(random), metres(random), metres(random)}};
      truth.push_back({{i * 33'000'000LL}, t});
      estimate.push_back({{i * 33'000'000LL}, {motion.rotation * t.rotation, motion * t.translation}});
    }
    const auto pairs = pairs_of(estimate, truth);
    EXPECT_LT(absolute_error(pairs, align_rigid(pairs)).max, 1e-12);
    EXPECT_LT(absolute_error(pairs, align_first_pose(pairs)).max, 1e-12);
  }
}

TEST(AlignRigid, HandComputedResidual) {
  // A square of side 2 against a rectangle 2 x 2.2, centred: the best fit leaves 0.1 at each corner, no
  // rotation helps.
  const std::vector<StampedPose> truth = {pose_at(0, {-1, -1, 0}), pose_at(1, {1, -1, 0}),
                                          pose_at(2, {1, 1, 0}), pose_at(3, {-1, 1, 0})};
  const std::vector<StampedPose> estimate = {pose_at(0, {-1, -1.1, 7}), pose_at(1, {1, -1.1, 7}),
                                             pose_at(2, {1, 1.1, 7}), pose_at(3, {-1, 1.1, 7})};
  const auto pairs = pairs_of(estimate, truth);
  const ErrorStatistics e = absolute_error(pairs, align_rigid(pairs));
  EXPECT_NEAR(e.rmse, 0.1, 1e-12);
  EXPECT_NEAR(e.max, 0.1, 1e-12);
}

TEST(AlignRigid, DoesNotMirror) {
  // The mirror image of a chiral point set: a reflection would give zero, which no camera can do.
  const std::vector<StampedPose> truth = {pose_at(0, {0, 0, 0}), pose_at(1, {1, 0, 0}), pose_at(2, {0, 2, 0}),
                                          pose_at(3, {0, 0, 3})};
  std::vector<StampedPose> estimate = truth;
  for (StampedPose& p : estimate) p.T_world_depth.translation.z = -p.T_world_depth.translation.z;
  const auto pairs = pairs_of(estimate, truth);
  const Alignment a = align_rigid(pairs);
  const auto& m = a.rotation.m;
  EXPECT_NEAR(m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) +
                  m[2] * (m[3] * m[7] - m[4] * m[6]),
              1, 1e-9);
  EXPECT_GT(absolute_error(pairs, a).rmse, 0.3);
}

TEST(AlignRigid, NeverWorseThanFirstPose) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, 0.02);
  for (int round = 0; round < 100; ++round) {
    std::vector<StampedPose> truth, estimate;
    for (int i = 0; i < 30; ++i) {
      const Vec3d p{0.1 * i, std::sin(0.3 * i), noise(random)};
      truth.push_back(pose_at(0.033 * i, p));
      estimate.push_back(pose_at(0.033 * i, p + Vec3d{noise(random), noise(random), noise(random)}));
    }
    const auto pairs = pairs_of(estimate, truth);
    EXPECT_LE(absolute_error(pairs, align_rigid(pairs)).rmse,
              absolute_error(pairs, align_first_pose(pairs)).rmse);
  }
}

TEST(RelativeError, PerSecondHandComputedCase) {
  // The estimate is 1 % too long and turns 2 degrees a second too much about y; a pose every 0.5 s.
  std::vector<StampedPose> truth, estimate;
  for (int i = 0; i <= 8; ++i) {
    truth.push_back(pose_at(0.5 * i, {0, 0.2 * i, 0}));
    estimate.push_back(pose_at(0.5 * i, {0, 0.202 * i, 0}, about_y(1.0 * i)));
  }
  const RelativeError e = relative_error_per_time(pairs_of(estimate, truth), rt::Duration{1'000'000'000});
  EXPECT_EQ(e.translation_m.count, 7u);
  EXPECT_NEAR(e.translation_m.rmse, 0.004, 1e-12);
  EXPECT_NEAR(e.translation_m.max, 0.004, 1e-12);
  EXPECT_NEAR(e.rotation_deg.median, 2, 1e-9);
}

TEST(RelativeError, PerMetreHandComputedCase) {
  std::vector<StampedPose> truth, estimate;
  for (int i = 0; i <= 40; ++i) {
    truth.push_back(pose_at(0.1 * i, {0.1 * i, 0, 0}));
    estimate.push_back(pose_at(0.1 * i, {0.103 * i, 0, 0}));
  }
  const RelativeError e = relative_error_per_path(pairs_of(estimate, truth), 1.0);
  EXPECT_GE(e.translation_m.count, 29u);
  EXPECT_NEAR(e.translation_m.median, 0.03, 0.0031);  // rounding may make the step 1.1 m
  EXPECT_LT(e.rotation_deg.max, 1e-6);
}

TEST(RelativeError, GapsLongerThanTheStepAreLeftOut) {
  const std::vector<StampedPose> poses = {pose_at(0, {}), pose_at(1, {}), pose_at(3, {}), pose_at(4.05, {})};
  EXPECT_EQ(relative_error_per_time(pairs_of(poses, poses), rt::Duration{1'000'000'000}).translation_m.count,
            2u);
}

TEST(RelativeError, PathShorterThanTheStepGivesNone) {
  const std::vector<StampedPose> poses = {pose_at(0, {}), pose_at(0.5, {0.1, 0, 0}),
                                          pose_at(0.9, {0.2, 0, 0})};
  const auto pairs = pairs_of(poses, poses);
  EXPECT_EQ(relative_error_per_path(pairs, 1.0).translation_m.count, 0u);
  EXPECT_EQ(relative_error_per_time(pairs, rt::Duration{1'000'000'000}).translation_m.count, 0u);
}

TEST(EvaluateTrajectory, FewerThanThreePartnersIsASentence) {
  const std::vector<StampedPose> truth = {pose_at(0, {}), pose_at(1, {}), pose_at(2, {})};
  const std::vector<StampedPose> estimate = {pose_at(10, {}), pose_at(11, {}), pose_at(12, {})};
  const auto report = evaluate_trajectory(estimate, truth);
  ASSERT_FALSE(report.has_value());
  EXPECT_EQ(report.error().code, rt::ExitCode::bad_input);
  EXPECT_NE(report.error().message.find("do not overlap"), std::string::npos);
}

TEST(EvaluateTrajectory, IdenticalTrajectoriesHaveNoError) {
  std::vector<StampedPose> poses;
  for (int i = 0; i < 90; ++i)
    poses.push_back(pose_at(i / 30.0, {0.03 * i, std::sin(0.1 * i), 0}, about_y(0.5 * i)));
  const auto report = evaluate_trajectory(poses, poses);
  ASSERT_TRUE(report.has_value());
  EXPECT_EQ(report->pairs_count, 90u);
  EXPECT_LT(report->ate_first_pose_m.max, 1e-12);
  EXPECT_LT(report->ate_rigid_m.max, 1e-12);
  EXPECT_GT(report->per_second.translation_m.count, 0u);
  EXPECT_LT(report->per_second.rotation_deg.max, 1e-5);
}

class TrajectoryFile : public ::testing::Test {
 protected:
  std::string error_of(std::string_view text) {
    const auto result = read_tum_trajectory(folder_.write("t.txt", text));
    if (result) return "no error";
    EXPECT_EQ(result.error().code, rt::ExitCode::bad_input);
    EXPECT_NE(result.error().message.find("t.txt"), std::string::npos) << "the sentence names no file";
    return result.error().message;
  }
  test::TemporaryFolder folder_;
};

TEST_F(TrajectoryFile, TumTextIsReadAsWritten) {
  const auto t = read_tum_trajectory(
      folder_.write("t.txt",
                    "# comment\n\n1305031229.528784 1.5 -2 3e-1 0 0 0.70710678 0.70710678\r\n"
                    "1305031229.564442 0 0 0 0 0 0 -1 # turned sign\n"));
  ASSERT_TRUE(t.has_value()) << t.error().message;
  ASSERT_EQ(t->poses.size(), 2u);
  EXPECT_NEAR(static_cast<double>(t->poses[0].time.ns - 1305031229528784000LL), 0,
              300);  // a double holds 240 ns here
  EXPECT_EQ(t->poses[0].T_world_depth.translation, (Vec3d{1.5, -2, 0.3}));
  EXPECT_NEAR(t->poses[0].T_world_depth.rotation(1, 0), 1, 1e-7);  // 90 degrees about z takes x to y
  EXPECT_NEAR(t->poses[1].T_world_depth.rotation(0, 0), 1, 1e-12);
}

TEST_F(TrajectoryFile, EveryKindOfGarbageIsASentenceWithTheLine) {
  EXPECT_NE(error_of("1 0 0 0 0 0 0 1\n2 0 nan 0 0 0 0 1\n").find(":2:"), std::string::npos);
  EXPECT_NE(error_of("1 0 0 0 0 0 0 1\n2 0 0 0 0 0 1\n").find(":2:"), std::string::npos);
  EXPECT_NE(error_of("1 0 0 0 0 0 0 1 9\n").find(":1:"), std::string::npos);
  EXPECT_NE(error_of("1 0 0 0 0 0 0 2\n").find("length"), std::string::npos);
  EXPECT_NE(error_of("1 0 0 0 0 0 0 0\n").find("length"), std::string::npos);
  EXPECT_NE(error_of("2 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n").find("not later"), std::string::npos);
  EXPECT_NE(error_of("1 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n").find("not later"), std::string::npos);
  EXPECT_NE(error_of("1e30 0 0 0 0 0 0 1\n").find("out of range"), std::string::npos);
  EXPECT_NE(error_of("hello\n").find(":1:"), std::string::npos);
  EXPECT_NE(error_of(std::string_view("\0\0\0\0", 4)).find(":1:"), std::string::npos);
  EXPECT_NE(error_of("").find("no pose"), std::string::npos);
  EXPECT_NE(error_of("# only a comment\n").find("no pose"), std::string::npos);
}

TEST_F(TrajectoryFile, MissingFileIsASentence) {
  const auto t = read_trajectory(folder_.path() / "absent.txt");
  ASSERT_FALSE(t.has_value());
  EXPECT_EQ(t.error().code, rt::ExitCode::bad_input);
}

constexpr const char* kIdentity = "1 0 0 0.5\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";

TEST_F(TrajectoryFile, SevenScenesFolderIsReadInFrameOrderAndSkipsNaN) {
  folder_.write("frame-000010.pose.txt", "0 0 1 2\n0 1 0 0\n-1 0 0 0\n0 0 0 1\n");
  folder_.write("frame-000002.pose.txt", kIdentity);
  folder_.write("frame-000003.pose.txt", "nan nan nan nan\nnan nan nan nan\nnan nan nan nan\n0 0 0 1\n");
  folder_.write("frame-000004.pose.txt", "-1.#IND -1.#IND -1.#IND 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
  folder_.write("frame-000005.pose.txt", "2 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
  folder_.write("frame-000006.pose.txt", "-1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
  folder_.write("notes.txt", "not a pose");
  const auto t = read_trajectory(folder_.path());
  ASSERT_TRUE(t.has_value()) << t.error().message;
  ASSERT_EQ(t->poses.size(), 2u);
  EXPECT_EQ(t->poses[0].time.ns, 66'666'666);
  EXPECT_EQ(t->poses[0].T_world_depth.translation.x, 0.5);
  EXPECT_EQ(t->poses[1].time.ns, 333'333'333);
  EXPECT_NEAR(t->poses[1].T_world_depth.rotation(0, 2), 1, 1e-12);
  EXPECT_EQ(t->rejected_count, 4u);
  EXPECT_NE(t->first_rejection.find("frame-000003"), std::string::npos);
}

TEST_F(TrajectoryFile, SevenScenesGarbageIsASentence) {
  folder_.write("frame-000001.pose.txt", "1 0 0 zero\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
  EXPECT_FALSE(read_trajectory(folder_.path()).has_value());
  folder_.write("frame-000001.pose.txt", "1 0 0 0\n0 1 0 0\n");
  EXPECT_FALSE(read_trajectory(folder_.path()).has_value());
  folder_.write("frame-000001.pose.txt", std::string(kIdentity) + "1\n");
  EXPECT_FALSE(read_trajectory(folder_.path()).has_value());
}

TEST_F(TrajectoryFile, FolderWithoutPosesIsASentence) {
  const auto t = read_trajectory(folder_.path());
  ASSERT_FALSE(t.has_value());
  EXPECT_NE(t.error().message.find("no groundtruth.txt"), std::string::npos);
}

TEST(RecordedTrajectory, SharedRecordingsAreRead) {
  const auto tum = test::shared_data("tum_fr1_rpy/groundtruth.txt");
  const auto kitchen = test::shared_data("kitchen_7scenes");
  if (!tum || !kitchen) GTEST_SKIP() << "the recordings beside the project are absent";
  const auto t = read_trajectory(*tum);
  ASSERT_TRUE(t.has_value()) << t.error().message;
  EXPECT_GT(t->poses.size(), 500u);
  const auto k = read_trajectory(*kitchen);
  ASSERT_TRUE(k.has_value()) << k.error().message;
  EXPECT_EQ(k->poses.size() + k->rejected_count, 121u);
  const auto self = evaluate_trajectory(t->poses, t->poses);
  ASSERT_TRUE(self.has_value());
  EXPECT_LT(self->ate_rigid_m.max, 1e-9);
}

}  // namespace
}  // namespace tactus::evaluate
