#include "pipeline/label/crf/brute_crf.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <limits>

#include "tests/pipeline/label/crf/clouds.hpp"

namespace tactus::label::test {
namespace {

CrfParameters few_points_parameters() {  // bandwidths for clouds of some hundred points
  CrfParameters p = three_kernels();
  p.smoothness = {1.3F, 0.06F};
  p.appearance = {2.0F, 0.3F, 40.0F};
  p.surface = {1.0F, 0.1F, 0.3F};
  p.iterations_max = 10;
  p.settled_change = 0;
  return p;
}

struct Brute {
  explicit Brute(const Cloud& cloud, const CrfParameters& parameters)
      : memory(BruteCrf::bytes_needed(kBrutePointsMax)), marginals(cloud.size() * kMaterialCount) {
    rt::Slice slice = memory.slice();
    sut.bind(slice, kBrutePointsMax);
    status = sut.prepare(cloud.points(), parameters);
  }
  Memory memory;
  BruteCrf sut;
  rt::Status status = rt::Status::ok;
  std::vector<double> marginals;
};

TEST(CrfKernels, TwoPointsGiveTheHandComputedValues) {
  Cloud cloud;
  cloud.add({0, 0, 0}, {100, 100, 100}, {0, 0, 1}, 0);
  cloud.add({0.03F, 0, 0.04F}, {110, 100, 80}, {0, 1, 0}, 0);
  say(cloud, 1, 0.9);
  say(cloud, 2, 0.9);
  CrfParameters p = few_points_parameters();
  p.smoothness = {2, 0.05F};
  p.appearance = {3, 0.1F, 20};
  p.surface = {5, 0.025F, 1};
  // |p|^2 = 0.0025, |I|^2 = 500, |n|^2 = 2
  const double k1 = std::exp(-0.0025 / (2 * 0.0025)), k2 = std::exp(-0.0025 / 0.02 - 500.0 / 800),
               k3 = std::exp(-0.0025 / (2 * 0.000625) - 1.0);
  EXPECT_NEAR(smoothness_kernel(cloud.points(), p, 0, 1), k1, 1e-6);
  EXPECT_NEAR(appearance_kernel(cloud.points(), p, 0, 1), k2, 1e-6);
  EXPECT_NEAR(surface_kernel(cloud.points(), p, 0, 1), k3, 1e-6);
  // Both degrees are 1 + k, so both normalisations agree here.
  const double expected = 2 * k1 / (1 + k1) + 3 * k2 / (1 + k2) + 5 * k3 / (1 + k3);
  for (const CrfNormalisation normalisation : {CrfNormalisation::symmetric, CrfNormalisation::per_point}) {
    p.normalisation = normalisation;
    Brute brute(cloud, p);
    ASSERT_EQ(brute.status, rt::Status::ok);
    EXPECT_NEAR(brute.sut.kernel(0, 1), expected, 1e-6);
    EXPECT_NEAR(brute.sut.kernel(0, 0), 2 / (1 + k1) + 3 / (1 + k2) + 5 / (1 + k3), 1e-6);
    const std::vector<MaterialId> apart{1, 2}, same{1, 1};
    const double right = -std::log(0.9), wrong = -std::log(0.1 / 22);
    EXPECT_NEAR(brute.sut.energy(apart), 2 * right + expected, 1e-5);
    EXPECT_NEAR(brute.sut.energy(same), right + wrong, 1e-5);
  }
}

TEST(CrfEnergy, AllPairsWithoutAMatrixGiveTheSame) {
  for (const CrfNormalisation normalisation : {CrfNormalisation::symmetric, CrfNormalisation::per_point}) {
    CrfParameters p = few_points_parameters();
    p.normalisation = normalisation;
    const Cloud cloud = corner_cloud(71, 12, 0.05, 0.3);
    Brute brute(cloud, p);
    ASSERT_EQ(brute.status, rt::Status::ok);
    std::vector<double> degree(3 * cloud.size());
    std::vector<MaterialId> labels = cloud.truth;
    for (std::size_t i = 0; i < labels.size(); i += 3)
      labels[i] = static_cast<MaterialId>(i % kMaterialCount);
    degrees_of(cloud.points(), p, degree);
    const CrfEnergy energy = energy_of(cloud.points(), p, labels, degree);
    EXPECT_NEAR(energy.total_nat(), brute.sut.energy(labels), 1e-3);
    EXPECT_GT(energy.pairwise_nat, 10);
  }
}

TEST(BruteCrf, FreeEnergyNeverRises) {
  for (const std::uint32_t seed : {81U, 82U, 83U}) {
    const Cloud corner = corner_cloud(seed, 7, 0.05, 0.3), chaos = random_cloud(seed, 120, 0.4);
    for (const Cloud* cloud : {&corner, &chaos}) {
      double before = std::numeric_limits<double>::infinity(), first = 0;
      for (int iterations = 0; iterations <= 6; ++iterations) {
        CrfParameters p = few_points_parameters();
        p.appearance.weight = 8;  // strong enough that updates at all points at once could overshoot
        p.iterations_max = iterations;
        Brute brute(*cloud, p);
        ASSERT_EQ(brute.status, rt::Status::ok);
        EXPECT_EQ(brute.sut.solve(brute.marginals).iterations, iterations);
        const double now_nat = brute.sut.free_energy(brute.marginals);
        EXPECT_LE(now_nat, before + 1e-6) << "seed " << seed << " iteration " << iterations;
        before = now_nat;
        if (iterations == 0) first = now_nat;
      }
      EXPECT_LT(before, first - 1);
    }
  }
}

TEST(BruteCrf, EnergyOfTheLabellingFallsAndWrongPointsAreCorrected) {
  const Cloud cloud = corner_cloud(91, 12, 0.05, 0.3, 0.3);
  CrfParameters p = few_points_parameters();
  p.appearance.weight = 4;
  Brute brute(cloud, p);
  ASSERT_EQ(brute.status, rt::Status::ok);
  std::vector<float> start(cloud.unary_nat.size()), end(start.size());
  for (std::size_t k = 0; k < start.size(); ++k) start[k] = -cloud.unary_nat[k];
  brute.sut.solve(brute.marginals);
  for (std::size_t k = 0; k < end.size(); ++k) end[k] = static_cast<float>(brute.marginals[k]);
  std::vector<MaterialId> before(cloud.size()), after(cloud.size());
  most_probable(start, before);
  most_probable(end, after);
  std::size_t wrong_before = 0, wrong_after = 0;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    wrong_before += before[i] != cloud.truth[i];
    wrong_after += after[i] != cloud.truth[i];
  }
  std::printf("brute, corner seed 91: %zu of %zu wrong before, %zu after; energy %.1f -> %.1f nat\n",
              wrong_before, cloud.size(), wrong_after, brute.sut.energy(before), brute.sut.energy(after));
  EXPECT_LT(brute.sut.energy(after), brute.sut.energy(before));
  EXPECT_GT(wrong_before, 100U);
  EXPECT_LT(wrong_after, wrong_before / 5);
}

TEST(BruteCrf, WithoutWeightsTheUnaryStands) {
  CrfParameters p = few_points_parameters();
  p.smoothness.weight = p.appearance.weight = p.surface.weight = 0;
  const Cloud cloud = random_cloud(101, 60, 0.3);
  Brute brute(cloud, p);
  ASSERT_EQ(brute.status, rt::Status::ok);
  brute.sut.solve(brute.marginals);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    double sum = 0;
    for (std::size_t l = 0; l < kMaterialCount; ++l)
      sum += std::exp(-static_cast<double>(cloud.unary_nat[i * kMaterialCount + l]));
    for (std::size_t l = 0; l < kMaterialCount; ++l)
      ASSERT_NEAR(brute.marginals[i * kMaterialCount + l],
                  std::exp(-static_cast<double>(cloud.unary_nat[i * kMaterialCount + l])) / sum, 1e-9);
  }
}

TEST(BruteCrf, PottsTreatsMaterialsAlike) {
  // The same cloud with materials 3 and 12 exchanged gives the same marginals, exchanged.
  const Cloud cloud = random_cloud(111, 80, 0.3);
  Cloud swapped = cloud;
  for (std::size_t i = 0; i < cloud.size(); ++i)
    std::swap(swapped.unary_nat[i * kMaterialCount + 3], swapped.unary_nat[i * kMaterialCount + 12]);
  Brute a(cloud, few_points_parameters()), b(swapped, few_points_parameters());
  a.sut.solve(a.marginals);
  b.sut.solve(b.marginals);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    ASSERT_NEAR(a.marginals[i * kMaterialCount + 3], b.marginals[i * kMaterialCount + 12], 1e-12);
    ASSERT_NEAR(a.marginals[i * kMaterialCount + 5], b.marginals[i * kMaterialCount + 5], 1e-12);
  }
}

TEST(BruteCrf, NoPointAndOnePointAreSolved) {
  const Cloud none;
  Brute empty(none, few_points_parameters());
  EXPECT_EQ(empty.status, rt::Status::ok);
  EXPECT_EQ(empty.sut.solve(empty.marginals).change_max, 0.0F);
  Cloud one;
  one.add({1, 2, 3}, {1, 2, 3}, {0, 1, 0}, 4);
  say(one, 4, 0.5);
  Brute single(one, few_points_parameters());
  ASSERT_EQ(single.status, rt::Status::ok);
  single.sut.solve(single.marginals);
  EXPECT_GT(single.marginals[4], 0.5) << "its own term makes a lone point surer, never another winner";
  EXPECT_NEAR(single.marginals[5], single.marginals[6], 1e-15);
}

TEST(BruteCrf, BadInputIsRefused) {
  const Cloud good = random_cloud(121, 10, 0.3);
  Cloud nan_unary = good, far = good, few = good;
  nan_unary.unary_nat[7] = std::numeric_limits<float>::quiet_NaN();
  far.position_m[3].y = std::numeric_limits<float>::infinity();
  few.unary_nat.pop_back();
  for (const Cloud* bad : {&nan_unary, &far, &few})
    EXPECT_EQ(Brute(*bad, few_points_parameters()).status, rt::Status::corrupt);
  CrfParameters negative = few_points_parameters(), flat = few_points_parameters(),
                lopsided = few_points_parameters();
  negative.smoothness.weight = -1;
  flat.surface.theta_normal = 0;
  lopsided.compatibility.is_potts = false;
  lopsided.compatibility.cost[1] = 1;
  for (const CrfParameters& bad : {negative, flat, lopsided})
    EXPECT_EQ(Brute(good, bad).status, rt::Status::corrupt);
  EXPECT_EQ(Brute(random_cloud(122, kBrutePointsMax + 1, 1), few_points_parameters()).status,
            rt::Status::full);
}

}  // namespace
}  // namespace tactus::label::test
