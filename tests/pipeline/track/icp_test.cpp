#include "pipeline/track/icp.hpp"

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <random>

#include "pipeline/track/tracker.hpp"
#include "rt/worker_pool.hpp"
#include "tests/pipeline/track/plane_room.hpp"

namespace tactus::track {
namespace {

using test::corner;
using test::live_view;
using test::ModelOfPlanes;
using test::motion;
using test::wall;

constexpr IcpLevel kFull = {1, 5, 0.1f};

template <typename Accumulate>
IcpSums all_chunks(const IcpInput& input, const T_ViewLive& T, const IcpLevel& level, Accumulate accumulate) {
  IcpSums sums;
  for (int chunk = 0; chunk < icp_chunks_count(*input.model, level.stride); ++chunk)
    icp_add(sums, accumulate(input, T, level, chunk));
  return sums;
}

std::vector<double> numbers_of(const IcpSums& sums) {
  std::vector<double> all(sums.h.begin(), sums.h.end());
  all.insert(all.end(), sums.b.begin(), sums.b.end());
  all.insert(all.end(), {sums.weighted_residual2, sums.weight, sums.inliers_count, sums.candidates_count,
                         sums.model_count});
  return all;
}

// A corner with depth noise, holes in both images, cleared normals, and brightness with unknown pixels.
struct NoisyCorner {
  ModelOfPlanes model{corner()};
  std::vector<float> live = live_view(corner(), motion({0.02, -0.03, 0.01}, {0.02, -0.01, 0.03}));

  std::vector<BrightnessWord> model_brightness = std::vector<BrightnessWord>(live.size());
  std::vector<Luma> live_luma = std::vector<Luma>(live.size() + kLumaPadding);

  explicit NoisyCorner(std::uint64_t seed) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<float> uniform(-1, 1);
    for (std::size_t i = 0; i < live.size(); ++i) {
      live[i] += 0.01f * uniform(random);
      const auto wave = 60.0f + 50.0f * std::sin(static_cast<float>(i) * 0.05f);
      const auto difference = [&] { return static_cast<std::uint32_t>(random() % 400) - 200u; };
      const auto width = static_cast<std::size_t>(model.view.camera.width);
      const bool border = i % width == 0 || i % width == width - 1 || i < width || i + width >= live.size();
      model_brightness[i] = border || random() % 20 == 0 ? 0u
                                               : static_cast<std::uint32_t>(4 * (20.0f + wave)) |
                                                     (difference() & 0x7FFu) << 10 | difference() << 21;
      live_luma[i] = random() % 20 == 0 ? Luma{0} : static_cast<Luma>(25.0f + wave + 3.0f * uniform(random));
      if (random() % 10 == 0) live[i] = 0;
      if (random() % 10 == 0) model.view.z_m[i] = 0;
      if (random() % 10 == 0) model.view.nx[i] = model.view.ny[i] = model.view.nz[i] = 0;
    }
  }
};

TEST(IcpAccumulate, EqualsTheDoubleReferenceUpToRounding) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    NoisyCorner room(seed);
    const IcpInput input{&room.model.view, room.live, 2.0f, room.model_brightness, room.live_luma};
    for (const IcpLevel& level : kTrackLevels)
      // Not the identity: there all points project onto pixel centres, on the border between two bilinear cells.
      for (const T_ViewLive& T : {motion({0.003, 0.002, -0.001}, {0.002, 0.001, -0.001}),
                                  motion({0.02, -0.03, 0.01}, {0.02, -0.01, 0.03})}) {
        const auto sut = all_chunks(input, T, level, icp_accumulate);
        const auto expected = all_chunks(input, T, level, icp_accumulate_reference);
        ASSERT_GT(expected.inliers_count, 500);
        // A point on the border of two pixels may go to either.
        EXPECT_NEAR(sut.inliers_count, expected.inliers_count, 0.002 * expected.inliers_count + 1);
        EXPECT_NEAR(sut.candidates_count, expected.candidates_count, 0.002 * expected.candidates_count + 1);
        EXPECT_NEAR(sut.model_count, expected.model_count, 2);
        EXPECT_NEAR(sut.weight, expected.weight, 0.002 * expected.weight);
        EXPECT_NEAR(sut.weighted_residual2, expected.weighted_residual2, 0.005 * expected.weighted_residual2);
        double largest = expected.weight;
        for (const double h : expected.h) largest = std::max(largest, std::fabs(h));
        for (std::size_t i = 0; i < 21; ++i) EXPECT_NEAR(sut.h[i], expected.h[i], 0.01 * largest) << i;
        double largest_b = 0;
        for (const double b : expected.b) largest_b = std::max(largest_b, std::fabs(b));
        for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(sut.b[i], expected.b[i], 0.02 * largest_b) << i;
      }
  }
}

TEST(IcpAccumulate, EveryInstructionSetGivesTheSameBits) {
  NoisyCorner room(7);
  const IcpInput input{&room.model.view, room.live, 2.0f, room.model_brightness, room.live_luma};
  const T_ViewLive T = motion({0.01, 0.02, -0.01}, {0.01, 0.01, 0.02});
  for (const IcpLevel& level : kTrackLevels) {
    std::vector<std::vector<double>> results;
    for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
      hwy::SetSupportedTargetsForTest(target);
      hwy::GetChosenTarget().Update(hwy::SupportedTargets());
      results.push_back(numbers_of(all_chunks(input, T, level, icp_accumulate)));
    }
    hwy::SetSupportedTargetsForTest(0);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    for (const auto& result : results)
      for (std::size_t i = 0; i < result.size(); ++i)
        EXPECT_EQ(std::bit_cast<std::uint64_t>(result[i]), std::bit_cast<std::uint64_t>(results[0][i]))
            << "number " << i << " at stride " << level.stride;
  }
}

// Geometry says nothing about a shift along a wall: only its texture can.
TEST(TrackFrame, TexturedWallFollowsASidewaysShift) {
  constexpr int kWidth = 160, kHeight = 120;
  constexpr double kFocal = 131, kDepthM = 2, kShiftM = 0.02;
  std::vector<float> planes(6 * kWidth * kHeight, 0.0f);
  const auto plane = [&](std::size_t i) {
    return std::span(planes).subspan(i * kWidth * kHeight, kWidth * kHeight);
  };
  map::ModelView view;
  view.camera = {kWidth, kHeight, kFocal, kFocal, 79.5, 59.5};
  view.z_m = plane(0);
  view.nx = plane(1);
  view.ny = plane(2);
  view.nz = plane(3);
  std::fill(view.z_m.begin(), view.z_m.end(), static_cast<float>(kDepthM));
  std::fill(view.nz.begin(), view.nz.end(), -1.0f);
  const std::vector<float> live(kWidth * kHeight, static_cast<float>(kDepthM));
  std::vector<std::uint16_t> quarters(live.size());
  std::vector<BrightnessWord> model_brightness(live.size());
  std::vector<Luma> live_luma(live.size() + kLumaPadding);
  const auto texture = [](double x, double y) {
    return static_cast<float>(128 + 60 * std::sin(9 * x) * std::cos(7 * y) + 20 * std::sin(3 * x + 5 * y));
  };
  for (int v = 0; v < kHeight; ++v)
    for (int u = 0; u < kWidth; ++u) {
      const double x = (u - 79.5) / kFocal * kDepthM, y = (v - 59.5) / kFocal * kDepthM;
      quarters[static_cast<std::size_t>(v * kWidth + u)] = static_cast<std::uint16_t>(4 * texture(x, y));
      live_luma[static_cast<std::size_t>(v * kWidth + u)] = static_cast<Luma>(texture(x + kShiftM, y));
    }
  take_differences(quarters, kWidth, kHeight, 0, kHeight, model_brightness);
  rt::WorkerPool pool;
  const auto sut = track_frame({&view, live, 2.0f, model_brightness, live_luma}, kTrackLevels, T_ViewLive{},
                               TrackConfig{.information_min = 1e-9}, pool);
  EXPECT_EQ(sut.status, rt::Status::ok);
  EXPECT_NEAR(sut.T_view_live.translation.x, kShiftM, 0.001);
  EXPECT_NEAR(sut.T_view_live.translation.y, 0, 0.001);
}

// One model point at a time: the row of the Jacobian is b / r, against central differences of the residual.
TEST(IcpAccumulate, JacobianIsTheDerivativeOfTheResidual) {
  const T_ViewLive T = motion({0.01, -0.02, 0.015}, {0.004, -0.003, 0.006});
  const auto live = live_view(corner(), motion({0.01, -0.02, 0.015}, {0.004, -0.003, 0.0045}));
  const ModelOfPlanes full(corner());
  int rows_count = 0;
  for (std::size_t pixel = 1234; pixel < live.size(); pixel += 977) {
    ModelOfPlanes one(corner());
    std::fill(one.view.z_m.begin(), one.view.z_m.end(), 0.0f);
    one.view.z_m[pixel] = full.view.z_m[pixel];
    const IcpInput input{&one.view, live, 1.7f};
    const auto residual = [&](const T_ViewLive& at) {
      return std::sqrt(all_chunks(input, at, kFull, icp_accumulate_reference).weighted_residual2);
    };
    const IcpSums sums = all_chunks(input, T, kFull, icp_accumulate_reference);
    const double r = std::sqrt(sums.weighted_residual2);
    if (sums.weight < 1 || r < 1e-4) continue;  // out of view, or beyond Huber's limit
    ++rows_count;
    for (std::size_t i = 0; i < 6; ++i) {
      constexpr double kStep = 1e-6;
      std::array<double, 6> up{}, down{};
      up[i] = kStep;
      down[i] = -kStep;
      const double pivot = static_cast<double>(input.pivot_z_m);
      const double slope =
          (residual(icp_apply(T, up, pivot)) - residual(icp_apply(T, down, pivot))) / (2 * kStep);
      EXPECT_NEAR(sums.b[i] / r, slope, 1e-4) << "pixel " << pixel << " parameter " << i;
    }
  }
  EXPECT_GT(rows_count, 8);
}

TEST(IcpAccumulate, EmptyImagesGiveNothing) {
  ModelOfPlanes model(corner());
  const std::vector<float> none(model.view.z_m.size(), 0.0f);
  const IcpSums sums = all_chunks({&model.view, none, 2.0f}, {}, kFull, icp_accumulate);
  EXPECT_EQ(sums.weight, 0);
  EXPECT_EQ(sums.candidates_count, 0);
  EXPECT_GT(sums.model_count, 0);
  EXPECT_EQ(icp_solve(sums, 1.0, 0.004).held_count, 6);
}

T_ViewLive solve_repeatedly(const ModelOfPlanes& model, const std::vector<float>& live, int iterations,
                            int& held_count) {
  const IcpInput input{&model.view, live, 2.0f};
  T_ViewLive T;
  for (int i = 0; i < iterations; ++i) {
    const IcpStep step = icp_solve(all_chunks(input, T, kFull, icp_accumulate), 1.0, 0.004);
    held_count = step.held_count;
    T = icp_apply(T, step.increment, 2.0);
  }
  return T;
}

TEST(IcpSolve, RecoversAKnownMotionInACorner) {
  const ModelOfPlanes model(corner());
  for (const T_ViewLive& truth : {motion({0.01, -0.015, 0.02}, {0.015, -0.02, 0.01}),
                                  motion({-0.02, 0.01, 0.005}, {-0.01, 0.01, -0.03})}) {
    int held_count = 0;
    const T_ViewLive found = solve_repeatedly(model, live_view(corner(), truth), 12, held_count);
    EXPECT_EQ(held_count, 0);
    EXPECT_LT((found.translation - truth.translation).norm(), 2e-4);
    const Rotation left = found.rotation.transposed() * truth.rotation;
    EXPECT_LT(std::fabs(left(0, 1)) + std::fabs(left(0, 2)) + std::fabs(left(1, 2)), 2e-4);
  }
}

class IcpFlatWall : public testing::TestWithParam<Vec3d> {};

TEST_P(IcpFlatWall, HoldsExactlyWhatCannotBeObserved) {
  const auto planes = wall(GetParam());
  const Vec3d n = planes[0].normal;
  const ModelOfPlanes model(planes);
  // Seen: a shift along the normal, turns about axes in the wall. Unseen: two shifts and the turn about the
  // normal.
  const Vec3d across = n.cross({0.3, 1, 0.2}).normalized();
  const T_ViewLive truth = motion(across * 0.01 + n * 0.02, n * 0.01 + across * 0.03);
  const auto live = live_view(planes, truth);
  const IcpInput input{&model.view, live, 2.0f};
  IcpStep step = icp_solve(all_chunks(input, {}, kFull, icp_accumulate), 1.0, 0.004);
  EXPECT_EQ(step.held_count, 3);
  for (int i = 0; i < 6; ++i) {
    EXPECT_EQ(step.information[static_cast<std::size_t>(i)] >= 0.004, i < 3) << i;
    if (i > 0) {
      EXPECT_LE(step.information[static_cast<std::size_t>(i)],
                step.information[static_cast<std::size_t>(i - 1)]);
    }
  }
  int held_count = 0;
  const T_ViewLive found = solve_repeatedly(model, live_view(planes, truth), 12, held_count);
  EXPECT_EQ(held_count, 3);
  // What is observed agrees: the wall lies where it does.
  EXPECT_NEAR(n.dot(found.translation), n.dot(truth.translation), 2e-4);
  EXPECT_LT((found.rotation.transposed() * n - truth.rotation.transposed() * n).norm(), 2e-4);
  // What is not observed stays: no shift in the wall beyond what turning about the pivot brings, no turn
  // about it.
  const Quaternion turn = found.rotation.quaternion();
  EXPECT_NEAR(Vec3d(turn.x, turn.y, turn.z).dot(n), 0, 2e-4);
  const Vec3d pivot{0, 0, 2.0};
  const Vec3d moved = found * pivot - pivot;
  EXPECT_LT((moved - n * moved.dot(n)).norm(), 5e-4);
}

INSTANTIATE_TEST_SUITE_P(Walls, IcpFlatWall,
                         testing::Values(Vec3d{0, 0, -1}, Vec3d{0.4, 0, -1}, Vec3d{-0.2, 0.5, -1}));

TEST(IcpApply, StaysARotation) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> uniform(-0.2, 0.2);
  T_ViewLive T;
  for (int i = 0; i < 2000; ++i) {
    std::array<double, 6> increment;
    for (double& x : increment) x = uniform(random);
    T = icp_apply(T, increment, 1.5);
    const Rotation unit = T.rotation.transposed() * T.rotation;
    for (std::size_t k = 0; k < 9; ++k) ASSERT_NEAR(unit.m[k], k % 4 == 0 ? 1 : 0, 1e-14);
  }
  EXPECT_TRUE(T.is_finite());
}

TEST(IcpApply, TurnsAboutThePivotToFirstOrder) {
  const T_ViewLive T = icp_apply({}, {1e-4, -2e-4, 3e-4, 0, 0, 0}, 2.0);
  EXPECT_LT((T * Vec3d{0, 0, 2.0} - Vec3d{0, 0, 2.0}).norm(), 1e-12);
  const Vec3d p{0.3, -0.2, 2.5};
  const Vec3d expected = p + Vec3d{1e-4, -2e-4, 3e-4}.cross(p - Vec3d{0, 0, 2.0});
  EXPECT_LT((T * p - expected).norm(), 1e-7);
}

}  // namespace
}  // namespace tactus::track
