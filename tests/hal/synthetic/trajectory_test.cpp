#include "hal/synthetic/trajectory.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "hal/synthetic/deterministic_math.hpp"
#include "hal/synthetic/synthetic.hpp"

namespace tactus::hal::synthetic {
namespace {

double angle_degrees(const Rotation& a, const Rotation& b) {
  const Quaternion q = (a.transposed() * b).quaternion();
  return 2 * std::asin(std::min(1.0, std::sqrt(q.x * q.x + q.y * q.y + q.z * q.z))) * 180 / M_PI;
}

LoopSpec loop_of(SceneId id) { return make_scene(id).loop(); }

TEST(SinCos, AgreesWithTheLibrary) {
  for (int i = -4000; i <= 4000; ++i) {
    const double turns = i * 0.00173;
    const auto [s, c] = sin_cos_turns(turns);
    EXPECT_NEAR(s, std::sin(2 * M_PI * turns), 2e-14);
    EXPECT_NEAR(c, std::cos(2 * M_PI * turns), 2e-14);
  }
}

TEST(Trajectory, ComesBackToItsStart) {
  for (const SceneId id : {SceneId::bedroom, SceneId::office, SceneId::wall, SceneId::corner}) {
    const LoopSpec loop = loop_of(id);
    for (const int frames : {60, 300, 777}) {
      SyntheticOptions options;
      options.frames_count = frames;
      const T_WorldDepth first = pose_at(options, loop, 0), last = pose_at(options, loop, frames - 1);
      EXPECT_EQ(first.translation, last.translation);
      EXPECT_EQ(first.rotation.m, last.rotation.m);
      // And arrives there: the frame before is already close.
      EXPECT_LT((pose_at(options, loop, frames - 2).translation - last.translation).norm(), 0.005);
    }
  }
}

TEST(Trajectory, KeepsItsSpeedLimits) {
  for (const SceneId id : {SceneId::bedroom, SceneId::office, SceneId::wall, SceneId::corner}) {
    const LoopSpec loop = loop_of(id);
    for (const int frames : {30, 60, 300, 900})
      for (const std::uint64_t seed : {1U, 2U, 3U, 4U, 5U}) {
        SyntheticOptions options;
        options.frames_count = frames;
        options.seed = seed;
        double fastest_m_per_s = 0, fastest_degrees_per_s = 0, path_m = 0;
        for (int i = 1; i < frames; ++i) {
          const T_WorldDepth a = pose_at(options, loop, i - 1), b = pose_at(options, loop, i);
          const double step_m = (b.translation - a.translation).norm();
          path_m += step_m;
          fastest_m_per_s = std::max(fastest_m_per_s, step_m * kFrameRate_hz);
          fastest_degrees_per_s =
              std::max(fastest_degrees_per_s, angle_degrees(a.rotation, b.rotation) * kFrameRate_hz);
        }
        EXPECT_LE(fastest_m_per_s, 0.5) << name(id) << " frames " << frames << " seed " << seed;
        EXPECT_LE(fastest_degrees_per_s, 40) << name(id) << " frames " << frames << " seed " << seed;
        if (frames == 300) {
          EXPECT_GT(path_m, 1.5);
        }
      }
  }
}

TEST(Trajectory, StartsSmoothly) {
  const LoopSpec loop = loop_of(SceneId::bedroom);
  const SyntheticOptions options;
  const T_WorldDepth a = pose_at(options, loop, 0), b = pose_at(options, loop, 1);
  EXPECT_LT((b.translation - a.translation).norm(), 0.002);
  EXPECT_LT(angle_degrees(a.rotation, b.rotation), 0.2);
}

TEST(Trajectory, TremblesByMillimetresAtTwoToFiveHertz) {
  // Loops that differ in nothing but the seed differ by tremor alone.
  const LoopSpec loop = loop_of(SceneId::bedroom);
  SyntheticOptions one, two;
  two.seed = 2;
  double largest_m = 0, largest_degrees = 0;
  std::vector<double> x;
  for (int i = 0; i < 300; ++i) {
    const T_WorldDepth a = pose_at(one, loop, i), b = pose_at(two, loop, i);
    largest_m = std::max(largest_m, (a.translation - b.translation).norm());
    largest_degrees = std::max(largest_degrees, angle_degrees(a.rotation, b.rotation));
    x.push_back(a.translation.x - b.translation.x);
  }
  EXPECT_GT(largest_m, 0.001);
  EXPECT_LT(largest_m, 0.006);
  EXPECT_GT(largest_degrees, 0.1);
  EXPECT_LT(largest_degrees, 0.6);
  // Its power lies between 2 and 5 Hz: compare the discrete Fourier transform's bands (0.1 Hz a bin).
  double in_band = 0, all = 0;
  for (int bin = 1; bin < 150; ++bin) {
    double re = 0, im = 0;
    for (int i = 0; i < 300; ++i) {
      re += x[static_cast<std::size_t>(i)] * std::cos(2 * M_PI * bin * i / 300);
      im += x[static_cast<std::size_t>(i)] * std::sin(2 * M_PI * bin * i / 300);
    }
    all += re * re + im * im;
    if (bin >= 19 && bin <= 50) in_band += re * re + im * im;
  }
  EXPECT_GT(in_band, 0.95 * all);
}

TEST(Trajectory, RotationsAreOrthonormal) {
  const LoopSpec loop = loop_of(SceneId::office);
  for (int i = 0; i < 300; i += 13) {
    const Rotation r = pose_at({}, loop, i).rotation;
    const Rotation identity = r * r.transposed();
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b) EXPECT_NEAR(identity(a, b), a == b ? 1 : 0, 1e-14);
    // The camera is held upright: its y axis points down.
    EXPECT_LT(r(1, 1), -0.8);
  }
}

TEST(Trajectory, StillNeverMoves) {
  const LoopSpec loop = loop_of(SceneId::bedroom);
  SyntheticOptions options;
  options.trajectory = TrajectoryKind::still;
  const T_WorldDepth first = pose_at(options, loop, 0);
  for (int i = 1; i < 300; ++i) {
    EXPECT_EQ(pose_at(options, loop, i).translation, first.translation);
    EXPECT_EQ(pose_at(options, loop, i).rotation.m, first.rotation.m);
  }
}

TEST(Trajectory, JumpsBehindTheBlankFrames) {
  const LoopSpec loop = loop_of(SceneId::bedroom);
  SyntheticOptions plain, jumping;
  jumping.blank_first = 100;
  jumping.blank_count = 6;
  jumping.has_jump = true;
  EXPECT_EQ(pose_at(jumping, loop, 105).translation, pose_at(plain, loop, 105).translation);
  for (const int i : {106, 200, 299}) {
    const T_WorldDepth a = pose_at(plain, loop, i), b = pose_at(jumping, loop, i);
    EXPECT_NEAR((a.translation - b.translation).norm(), 0.13, 1e-12);
    EXPECT_NEAR(angle_degrees(a.rotation, b.rotation), 6.5, 1e-6);
  }
}

TEST(Trajectory, NeverComesCloserThanHalfAMetre) {
  for (const SceneId id : {SceneId::bedroom, SceneId::office, SceneId::wall, SceneId::corner}) {
    SyntheticOptions options;
    options.scene = id;
    options.mode = Mode::qvga_320x240;
    options.blank_first = 1;
    options.blank_count = 1;
    options.has_jump = true;  // the displaced path is the one nearer to things
    FrameRenderer renderer(std::make_shared<const Scene>(make_scene(id)), options);
    std::vector<float> z(320 * 240);
    for (int frame = 0; frame < 300; frame += 12) {
      renderer.exact_depth(frame, z);
      for (const float depth_m : z) {
        if (depth_m > 0) {
          ASSERT_GE(depth_m, 0.5F) << name(id) << " frame " << frame;
        }
      }
      EXPECT_GT(renderer.scene().distance(renderer.pose(frame).translation), 0.2);
    }
  }
}

TEST(Trajectory, FurnishedRoomsNeverShowOneFlatWallAlone) {
  for (const SceneId id : {SceneId::bedroom, SceneId::office}) {
    SyntheticOptions options;
    options.scene = id;
    options.mode = Mode::qvga_320x240;
    const Scene scene = make_scene(id);
    Raycaster caster(scene, calibration_of(options).depth);
    Hits hits(320 * 240);
    for (int frame = 0; frame < 300; frame += 12) {
      caster.cast(pose_at(options, scene.loop(), frame), hits);
      caster.find_normals(pose_at(options, scene.loop(), frame), hits);
      // Normals spread in all directions: the least eigenvalue of their second moment is bounded by the least
      // share of squared components along any axis; the room's axes are where a lone wall would show.
      double xx = 0, yy = 0, zz = 0;
      for (std::size_t i = 0; i < hits.pixels_count(); ++i) {
        xx += static_cast<double>(hits.normal_x[i] * hits.normal_x[i]);
        yy += static_cast<double>(hits.normal_y[i] * hits.normal_y[i]);
        zz += static_cast<double>(hits.normal_z[i] * hits.normal_z[i]);
      }
      const double all = xx + yy + zz;
      EXPECT_GT(std::min(xx, std::min(yy, zz)) / all, 0.04) << name(id) << " frame " << frame;
    }
  }
}

}  // namespace
}  // namespace tactus::hal::synthetic
