#include "pipeline/label/crf/batch_crf.hpp"

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <limits>
#include <numeric>

#include "pipeline/label/crf/brute_crf.hpp"
#include "tests/pipeline/label/crf/clouds.hpp"

namespace tactus::label::test {
namespace {

CrfParameters few_points_parameters() {
  CrfParameters p = three_kernels();
  p.smoothness = {1.3F, 0.06F};
  p.appearance = {2.0F, 0.3F, 40.0F};
  p.surface = {1.0F, 0.1F, 0.3F};
  p.iterations_max = 10;
  p.settled_change = 0;
  return p;
}

struct Batch {
  Batch(const Cloud& cloud, const CrfParameters& parameters)
      : Batch(cloud, parameters, BatchCrfConfig::for_any_points(cloud.size())) {}
  Batch(const Cloud& cloud, const CrfParameters& parameters, const BatchCrfConfig& config)
      : memory(BatchCrf::bytes_needed(config)), marginals(cloud.size() * kMaterialCount) {
    rt::Slice slice = memory.slice();
    sut.bind(slice, config);
    left_over_bytes = slice.bytes_left();
    status = sut.prepare(cloud.points(), parameters);
    if (status == rt::Status::ok) report = sut.solve(marginals);
  }
  Memory memory;
  BatchCrf sut;
  std::size_t left_over_bytes = 0;
  rt::Status status = rt::Status::ok;
  CrfReport report;
  std::vector<float> marginals;
};

std::vector<double> brute_marginals(const Cloud& cloud, const CrfParameters& parameters) {
  const Memory memory(BruteCrf::bytes_needed(kBrutePointsMax));
  rt::Slice slice = memory.slice();
  BruteCrf brute;
  brute.bind(slice, kBrutePointsMax);
  EXPECT_EQ(brute.prepare(cloud.points(), parameters), rt::Status::ok);
  std::vector<double> marginals(cloud.size() * kMaterialCount);
  brute.solve(marginals);
  return marginals;
}

void print(const char* what, std::uint32_t seed, std::size_t points, const Difference& d) {
  std::printf(
      "%-34s seed %u: %zu points, total variation mean %.4f, largest |difference| %.3f, same winner %.2f "
      "%%\n",
      what, seed, points, d.mean, d.largest, 100 * d.same_winner_share);
}

CrfCompatibility graded_compatibility() {
  CrfCompatibility c;
  c.is_potts = false;
  for (std::size_t a = 0; a < kMaterialCount; ++a)
    for (std::size_t b = 0; b < kMaterialCount; ++b)
      c.cost[a * kMaterialCount + b] = a == b ? 0.0F : 0.5F + 0.05F * static_cast<float>((a + b) % 20);
  return c;
}

TEST(BatchCrf, AgreesWithBruteForceOnARoomsCorner) {
  for (const std::uint32_t seed : {1U, 2U, 3U})
    for (const CrfNormalisation normalisation : {CrfNormalisation::symmetric, CrfNormalisation::per_point})
      for (const bool is_potts : {true, false}) {
        const Cloud cloud = corner_cloud(seed, 12, 0.04, 0.3);
        CrfParameters p = few_points_parameters();
        p.normalisation = normalisation;
        if (!is_potts) p.compatibility = graded_compatibility();
        const Batch sut(cloud, p);
        ASSERT_EQ(sut.status, rt::Status::ok);
        const Difference d = compare(sut.marginals, brute_marginals(cloud, p));
        print(is_potts ? "batch - brute, corner, Potts" : "batch - brute, corner, matrix", seed, cloud.size(),
              d);
        EXPECT_LT(d.mean, 0.01);
        EXPECT_LT(d.largest, 0.12);
        EXPECT_GE(d.same_winner_share, 0.98);
      }
}

TEST(BatchCrf, AgreesWithBruteForceOnRandomClouds) {
  for (const std::uint32_t seed : {4U, 5U, 6U}) {
    const Cloud cloud = random_cloud(seed, 400, 0.35);
    const CrfParameters p = few_points_parameters();
    const Batch sut(cloud, p);
    ASSERT_EQ(sut.status, rt::Status::ok);
    const Difference d = compare(sut.marginals, brute_marginals(cloud, p));
    print("batch - brute, random", seed, cloud.size(), d);
    EXPECT_LT(d.mean, 0.01);
    EXPECT_LT(d.largest, 0.03);
    EXPECT_GE(d.same_winner_share, 0.95) << "noise has winners by a hair";
  }
}

TEST(BatchCrf, EqualUnaryCostsShareAColumnAndChangeNothing) {
  // One cloud where 20 materials are never said (their costs equal everywhere), and the same with one of
  // these costs moved by the least amount at one point: 23 columns instead of few, and the same marginals to
  // rounding.
  Cloud cloud = corner_cloud(7, 12, 0.04, 0);
  const CrfParameters p = few_points_parameters();
  const Batch merged(cloud, p);
  for (std::size_t l = 0; l < kMaterialCount; ++l) {
    float& cost = cloud.unary_nat[l * kMaterialCount + l];
    for (std::size_t k = 0; k < l; ++k) cost = std::nextafter(cost, 100.0F);
  }
  const Batch full(cloud, p);
  EXPECT_LE(merged.sut.engine().columns_count(), 4U);
  EXPECT_EQ(merged.sut.engine().columns_padded(), 8U);
  EXPECT_GE(full.sut.engine().columns_count(), 20U);
  EXPECT_EQ(full.sut.engine().columns_padded(), 24U);
  EXPECT_LT(compare(merged.marginals, full.marginals).largest, 1e-4);
}

TEST(BatchCrf, MarginalsAreDistributions) {
  const Cloud cloud = random_cloud(8, 1000, 0.5);
  const Batch sut(cloud, few_points_parameters());
  ASSERT_EQ(sut.status, rt::Status::ok);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    float sum = 0;
    for (std::size_t l = 0; l < kMaterialCount; ++l) {
      ASSERT_GE(sut.marginals[i * kMaterialCount + l], 0.0F);
      sum += sut.marginals[i * kMaterialCount + l];
    }
    ASSERT_NEAR(sum, 1, 1e-5F);
  }
}

TEST(BatchCrf, WithoutWeightsTheUnaryStands) {
  CrfParameters p = few_points_parameters();
  p.smoothness.weight = p.appearance.weight = p.surface.weight = 0;
  const Cloud cloud = random_cloud(9, 100, 0.3);
  const Batch sut(cloud, p);
  ASSERT_EQ(sut.status, rt::Status::ok);
  EXPECT_LT(compare(sut.marginals, brute_marginals(cloud, p)).largest, 1e-6);
}

TEST(BatchCrf, EnergyOfTheLabellingFalls) {
  for (const std::uint32_t seed : {10U, 11U}) {
    const Cloud cloud = corner_cloud(seed, 20, 0.03, 0.3, 0.3);
    CrfParameters p = few_points_parameters();
    p.appearance.weight = 4;
    p.iterations_max = 0;
    const Batch start(cloud, p);
    p.iterations_max = 10;
    const Batch end(cloud, p);
    std::vector<MaterialId> before(cloud.size()), after(cloud.size());
    most_probable(start.marginals, before);
    most_probable(end.marginals, after);
    std::vector<double> degree(3 * cloud.size());
    degrees_of(cloud.points(), p, degree);
    const double nat_before = energy_of(cloud.points(), p, before, degree).total_nat(),
                 nat_after = energy_of(cloud.points(), p, after, degree).total_nat();
    std::printf("batch, corner of %zu, seed %u: energy %.1f -> %.1f nat\n", cloud.size(), seed, nat_before,
                nat_after);
    EXPECT_LT(nat_after, 0.8 * nat_before);
  }
}

TEST(BatchCrf, OrderOfThePointsDoesNotMatter) {
  const Cloud cloud = corner_cloud(12, 12, 0.04, 0.3);
  Cloud reversed;
  for (std::size_t i = cloud.size(); i-- > 0;) {
    reversed.add(cloud.position_m[i], cloud.color[i], cloud.normal[i], cloud.truth[i]);
    for (std::size_t l = 0; l < kMaterialCount; ++l)
      reversed.unary_nat.push_back(cloud.unary_nat[i * kMaterialCount + l]);
  }
  const Batch a(cloud, few_points_parameters()), b(reversed, few_points_parameters());
  for (std::size_t i = 0; i < cloud.size(); ++i)
    for (std::size_t l = 0; l < kMaterialCount; ++l)
      ASSERT_NEAR(a.marginals[i * kMaterialCount + l],
                  b.marginals[(cloud.size() - 1 - i) * kMaterialCount + l], 1e-4F);
}

TEST(BatchCrf, SecondRunGivesTheSameBits) {
  const Cloud cloud = corner_cloud(13, 20, 0.03, 0.3), other = random_cloud(14, 1200, 1);
  Batch sut(cloud, few_points_parameters());
  const std::vector<float> first = sut.marginals;
  std::vector<float> ignored(other.size() * kMaterialCount);
  ASSERT_EQ(sut.sut.prepare(other.points(), few_points_parameters()), rt::Status::ok);
  static_cast<void>(sut.sut.solve(ignored));
  ASSERT_EQ(sut.sut.prepare(cloud.points(), few_points_parameters()), rt::Status::ok);
  static_cast<void>(sut.sut.solve(sut.marginals));
  EXPECT_EQ(std::memcmp(first.data(), sut.marginals.data(), first.size() * sizeof(float)), 0);
}

TEST(BatchCrf, EveryInstructionSetGivesTheSameBits) {
  for (const bool is_potts : {true, false}) {
    const Cloud few = corner_cloud(18, 15, 0.04, 0), many = random_cloud(19, 500, 0.4);
    CrfParameters p = few_points_parameters();
    if (!is_potts) p.compatibility = graded_compatibility();
    for (const Cloud* cloud : {&few, &many}) {
      const Batch expected(*cloud, p);
      int targets_count = 0;
      for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
        hwy::SetSupportedTargetsForTest(target);
        hwy::GetChosenTarget().Update(hwy::SupportedTargets());
        const Batch sut(*cloud, p);
        EXPECT_EQ(std::memcmp(expected.marginals.data(), sut.marginals.data(),
                              sut.marginals.size() * sizeof(float)),
                  0)
            << hwy::TargetName(target);
        ++targets_count;
      }
      hwy::SetSupportedTargetsForTest(0);
      hwy::GetChosenTarget().Update(hwy::SupportedTargets());
      EXPECT_GE(targets_count, 1);
    }
  }
}

TEST(BatchCrf, ComputingOnlyWhatMovedGivesTheSameBits) {
  for (const bool is_potts : {true, false})
    for (const std::uint32_t seed : {21U, 22U, 23U}) {
      const Cloud corner = corner_cloud(seed, 25, 0.02, 0.3, 0.3), chaos = random_cloud(seed, 1500, 0.6);
      for (const Cloud* cloud : {&corner, &chaos}) {
        CrfParameters p = few_points_parameters();
        if (!is_potts) p.compatibility = graded_compatibility();
        p.appearance.weight = 4;
        p.iterations_max = 20;
        const Batch sut(*cloud, p);
        p.settled_change = -1;
        const Batch everything(*cloud, p);
        EXPECT_EQ(std::memcmp(sut.marginals.data(), everything.marginals.data(),
                              sut.marginals.size() * sizeof(float)),
                  0)
            << "seed " << seed;
        EXPECT_LE(sut.report.points_updated, everything.report.points_updated);
      }
    }
}

TEST(BatchCrf, EndsWhenSettled) {
  for (const std::uint32_t seed : {15U, 24U}) {
    const Cloud cloud = corner_cloud(seed, 20, 0.03, 0.3, 0.3);
    CrfParameters p = few_points_parameters();
    p.appearance.weight = 4;
    p.iterations_max = 200;
    const Batch exact(cloud, p);
    p.settled_change = 1e-3F;
    const Batch sut(cloud, p);
    EXPECT_GT(sut.report.iterations, 2);
    EXPECT_LT(sut.report.iterations, 100);
    EXPECT_LE(sut.report.change_max, 1e-3F);
    EXPECT_LT(sut.report.points_updated, exact.report.points_updated);
    const Difference d = compare(sut.marginals, exact.marginals);
    print("settled at 0.001 - exact", seed, cloud.size(), d);
    EXPECT_LT(d.mean, 0.003);
    EXPECT_GE(d.same_winner_share, 0.998);
  }
}

TEST(BatchCrf, NoPointOnePointAndCoincidentPointsAreSolved) {
  const Cloud none;
  EXPECT_EQ(Batch(none, few_points_parameters()).status, rt::Status::ok);
  Cloud one;
  one.add({1, 2, 3}, {1, 2, 3}, {0, 1, 0}, 4);
  say(one, 4, 0.5);
  const Batch single(one, few_points_parameters());
  ASSERT_EQ(single.status, rt::Status::ok);
  EXPECT_LT(compare(single.marginals, brute_marginals(one, few_points_parameters())).largest, 1e-4);
  Cloud pile;
  for (int i = 0; i < 50; ++i) {
    pile.add({1, 2, 3}, {1, 2, 3}, {0, 1, 0}, 4);
    say(pile, static_cast<MaterialId>(i < 45 ? 4 : 7), 0.2);
  }
  const Batch piled(pile, few_points_parameters());
  ASSERT_EQ(piled.status, rt::Status::ok);
  std::vector<MaterialId> labels(pile.size());
  most_probable(piled.marginals, labels);
  EXPECT_EQ(std::count(labels.begin(), labels.end(), MaterialId{4}), 50);
}

TEST(BatchCrf, FullAndBadInputAreDefined) {
  const Cloud cloud = random_cloud(16, 300, 1);
  BatchCrfConfig few_smoothness = BatchCrfConfig::for_any_points(300), few_appearance = few_smoothness,
                 few_surface = few_smoothness, few_slots = few_smoothness, few_points = few_smoothness;
  few_smoothness.smoothness.vertices_max = few_appearance.appearance.vertices_max =
      few_surface.surface.vertices_max = 50;
  few_slots.surface.slots_max = 100;
  few_points.points_max = 299;
  EXPECT_EQ(Batch(cloud, few_points_parameters(), few_slots).status, rt::Status::full);
  EXPECT_EQ(Batch(cloud, few_points_parameters(), few_smoothness).status, rt::Status::full);
  EXPECT_EQ(Batch(cloud, few_points_parameters(), few_appearance).status, rt::Status::full);
  EXPECT_EQ(Batch(cloud, few_points_parameters(), few_surface).status, rt::Status::full);
  EXPECT_EQ(Batch(cloud, few_points_parameters(), few_points).status, rt::Status::full);
  Cloud bad = cloud;
  bad.normal[5].x = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(Batch(bad, few_points_parameters()).status, rt::Status::corrupt);
  bad = cloud;
  bad.position_m[5].x = 1e9F;
  EXPECT_EQ(Batch(bad, few_points_parameters()).status, rt::Status::corrupt) << "too far for the lattice";
  Batch sut(cloud, few_points_parameters());
  EXPECT_EQ(sut.sut.prepare(bad.points(), few_points_parameters()), rt::Status::corrupt);
  EXPECT_EQ(sut.sut.engine().points_count(), 0U) << "nothing is left prepared";
  ASSERT_EQ(sut.sut.prepare(cloud.points(), few_points_parameters()), rt::Status::ok)
      << "and the next one is solved";
}

TEST(BatchCrf, BytesNeededAreWhatBindTakes) {
  const Cloud cloud = random_cloud(17, 77, 1);
  EXPECT_EQ(Batch(cloud, few_points_parameters()).left_over_bytes, 0U);
}

}  // namespace
}  // namespace tactus::label::test
