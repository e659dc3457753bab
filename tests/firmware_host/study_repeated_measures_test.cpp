#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <cstdio>
#include <random>
#include <vector>

#include "firmware_host/repeated_measures.hpp"

namespace tactus::firmware {
namespace {

// A course's worked example (Laerd Statistics, "ANOVA with repeated measures"): fitness of six people before, after three
// and after six months of training; printed there: F(1.277, 6.384) = 12.53, p = .009, W = .434, chi2 = 3.343, p = .188.
TEST(RepeatedMeasures, WorkedExampleOfSixPeople) {
  const Ratings ratings{3, {45, 50, 55, 42, 42, 45, 36, 41, 43, 39, 35, 40, 51, 55, 59, 44, 49, 56}};
  const RepeatedMeasures sut = repeated_measures(ratings);
  EXPECT_NEAR(sut.ss_conditions, 143.44, 0.01);
  EXPECT_NEAR(sut.ss_participants, 658.28, 0.01);
  EXPECT_NEAR(sut.ss_error, 57.22, 0.01);
  EXPECT_NEAR(sut.uncorrected.f, 12.53, 0.01);
  EXPECT_EQ(sut.uncorrected.df_effect, 2);
  EXPECT_EQ(sut.uncorrected.df_error, 10);
  EXPECT_NEAR(sut.uncorrected.p, 0.002, 0.0005);
  EXPECT_NEAR(sut.sphericity.w, 0.434, 0.0005);
  EXPECT_NEAR(sut.sphericity.chi2, 3.343, 0.001);
  EXPECT_NEAR(sut.sphericity.p, 0.188, 0.0005);
  EXPECT_NEAR(sut.corrected.df_effect, 1.277, 0.0005);
  EXPECT_NEAR(sut.corrected.df_error, 6.384, 0.0005);
  EXPECT_NEAR(sut.corrected.p, 0.009, 0.0005);
  EXPECT_NEAR(sut.partial_eta2, 0.715, 0.0005);
}

// The paper, section V-B: chi2 = 42.029 of 62 people; F(1.330, 81.135) = 212.293.
TEST(RepeatedMeasures, PapersDegreesOfFreedomFollowFromItsChi2) {
  const double w = mauchly_w_of(42.029, 62, 3), epsilon = epsilon_of_three_conditions(w);
  EXPECT_NEAR(w, 0.49635, 5e-6);
  EXPECT_NEAR(epsilon, 0.665, 0.0005);
  EXPECT_NEAR(2 * epsilon, 1.330, 0.0005);
  EXPECT_NEAR(2 * 61 * epsilon, 81.135, 0.002);
  EXPECT_LT(f_test(212.293, 1.330, 81.135).p, 0.001);
}

// Rows with exactly the given means and covariance.
Ratings exact_sample(std::size_t n, const Eigen::Vector3d& mean, const Eigen::Matrix3d& covariance, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  Eigen::MatrixXd x(static_cast<Eigen::Index>(n), 3);
  for (Eigen::Index i = 0; i < x.size(); ++i) x.data()[i] = normal(random);
  x.rowwise() -= x.colwise().mean().eval();
  const Eigen::Matrix3d own = x.transpose() * x / static_cast<double>(n - 1);
  const Eigen::Matrix3d whiten = Eigen::Matrix3d(own.llt().matrixU()).inverse();
  x = (x * whiten * Eigen::Matrix3d(covariance.llt().matrixU())).eval();
  x.rowwise() += mean.transpose();
  Ratings ratings{3, {}};
  for (Eigen::Index i = 0; i < x.rows(); ++i)
    for (Eigen::Index c = 0; c < 3; ++c) ratings.values.push_back(x(i, c));
  return ratings;
}

TEST(RepeatedMeasures, PapersMeansAndDeviationsGiveNearlyItsF) {
  const Eigen::Vector3d mean{8.427, 5.935, 3.71}, sd{1.995, 1.458, 1.99};
  Eigen::Matrix3d correlation;
  correlation << 1, 0.52, 0.52, 0.52, 1, 0.52, 0.52, 0.52, 1;
  const Ratings ratings = exact_sample(62, mean, sd.asDiagonal() * correlation * sd.asDiagonal(), 1);
  const RepeatedMeasures sut = repeated_measures(ratings);
  EXPECT_NEAR(sut.uncorrected.f, 212.3, 0.03 * 212.3) << "one correlation for all three pairs is a guess";
  EXPECT_NEAR(spread_of(std::vector<double>{1, 2, 3, 4}).sd, std::sqrt(5.0 / 3), 1e-12);
}

double residual(const Eigen::MatrixXd& columns, const Eigen::VectorXd& y) {
  const Eigen::VectorXd fitted = columns * columns.colPivHouseholderQr().solve(y);
  return (y - fitted).squaredNorm();
}

// The oracle: sums of squares as what leaving columns out of a linear model costs, effects coded -1 0 1 (type III), and
// epsilon by Box's formula over the covariance of the conditions themselves.
TEST(MixedAnova, EqualsNestedLinearModelsForGroupsOfAnySize) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    const std::size_t k = 2 + random() % 4, groups_count = 2 + random() % 2, n = groups_count * 3 + random() % 12;
    std::vector<std::size_t> group(n);
    for (std::size_t s = 0; s < n; ++s) group[s] = s < groups_count * 2 ? s % groups_count : random() % groups_count;
    Ratings ratings{k, {}};
    for (std::size_t s = 0; s < n; ++s) {
      const double own = normal(random);
      for (std::size_t c = 0; c < k; ++c)
        ratings.values.push_back(own + 0.4 * static_cast<double>(c * group[s]) + normal(random) * (1 + 0.3 * static_cast<double>(c)));
    }
    const MixedAnova sut = mixed_anova(ratings, group, groups_count);

    const auto rows = static_cast<Eigen::Index>(n * k), of_people = static_cast<Eigen::Index>(n);
    const auto of_conditions = static_cast<Eigen::Index>(k - 1), of_groups = static_cast<Eigen::Index>(groups_count - 1);
    Eigen::MatrixXd people = Eigen::MatrixXd::Zero(rows, of_people), condition = Eigen::MatrixXd::Zero(rows, of_conditions),
                    both = Eigen::MatrixXd::Zero(rows, of_conditions * of_groups);
    const auto effect = [](std::size_t level, std::size_t levels, Eigen::Index column) {
      return level == levels - 1 ? -1.0 : static_cast<Eigen::Index>(level) == column ? 1.0 : 0.0;
    };
    Eigen::VectorXd y(rows);
    for (std::size_t s = 0; s < n; ++s)
      for (std::size_t c = 0; c < k; ++c) {
        const auto row = static_cast<Eigen::Index>(s * k + c);
        y(row) = ratings.at(s, c);
        people(row, static_cast<Eigen::Index>(s)) = 1;
        for (Eigen::Index i = 0; i < of_conditions; ++i) {
          condition(row, i) = effect(c, k, i);
          for (Eigen::Index j = 0; j < of_groups; ++j)
            both(row, i * of_groups + j) = effect(c, k, i) * effect(group[s], groups_count, j);
        }
      }
    const auto joined = [](const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
      Eigen::MatrixXd all(a.rows(), a.cols() + b.cols());
      all << a, b;
      return all;
    };
    const double error = residual(joined(joined(people, condition), both), y);
    const double ss_interaction = residual(joined(people, condition), y) - error;
    const double ss_conditions = residual(joined(people, both), y) - error;
    const double df_error = static_cast<double>((k - 1) * (n - groups_count)), df_conditions = static_cast<double>(k - 1),
                 df_interaction = df_conditions * static_cast<double>(groups_count - 1);
    EXPECT_NEAR(sut.conditions.f, ss_conditions / df_conditions / (error / df_error), 1e-8 * (1 + sut.conditions.f));
    EXPECT_NEAR(sut.interaction.f, ss_interaction / df_interaction / (error / df_error), 1e-8 * (1 + sut.interaction.f));

    Eigen::VectorXd mean_of(of_people);
    Eigen::MatrixXd grand = Eigen::MatrixXd::Ones(of_people, 1), groups = Eigen::MatrixXd::Zero(of_people, of_groups + 1);
    for (std::size_t s = 0; s < n; ++s) {
      mean_of(static_cast<Eigen::Index>(s)) = y.segment(static_cast<Eigen::Index>(s * k), static_cast<Eigen::Index>(k)).mean();
      groups(static_cast<Eigen::Index>(s), static_cast<Eigen::Index>(group[s])) = 1;
    }
    const double people_left = residual(groups, mean_of), between = residual(grand, mean_of) - people_left;
    const double df_people = static_cast<double>(n - groups_count), df_between = static_cast<double>(groups_count - 1);
    EXPECT_NEAR(sut.between.f, between / df_between / (people_left / df_people), 1e-8 * (1 + sut.between.f));
    EXPECT_EQ(sut.between.df_effect, df_between);
    EXPECT_EQ(sut.between.df_error, df_people);

    Eigen::MatrixXd within(of_people, static_cast<Eigen::Index>(k));
    for (std::size_t s = 0; s < n; ++s)
      within.row(static_cast<Eigen::Index>(s)) = y.segment(static_cast<Eigen::Index>(s * k), static_cast<Eigen::Index>(k)).transpose();
    for (std::size_t g = 0; g < groups_count; ++g) {
      Eigen::RowVectorXd mean = Eigen::RowVectorXd::Zero(static_cast<Eigen::Index>(k));
      double count = 0;
      for (std::size_t s = 0; s < n; ++s)
        if (group[s] == g) mean += within.row(static_cast<Eigen::Index>(s)), count += 1;
      for (std::size_t s = 0; s < n; ++s)
        if (group[s] == g) within.row(static_cast<Eigen::Index>(s)) -= mean / count;
    }
    const Eigen::MatrixXd v = within.transpose() * within;
    const auto kd = static_cast<double>(k);
    const double diagonal = v.diagonal().mean(), all = v.mean(), row_squares = v.rowwise().mean().squaredNorm();
    const double epsilon = kd * kd * (diagonal - all) * (diagonal - all) /
                           ((kd - 1) * (v.squaredNorm() - 2 * kd * row_squares + kd * kd * all * all));
    EXPECT_NEAR(sut.epsilon, epsilon, 1e-9);
    EXPECT_NEAR(sut.interaction.df_error, df_error * epsilon, 1e-6);
  }
}

TEST(RepeatedMeasures, TwoConditionsAreThePairedTTest) {
  const Ratings ratings{2, {1, 3, 2, 5, 4, 4, 3, 6, 5, 9}};
  const RepeatedMeasures sut = repeated_measures(ratings);
  const std::vector<PairTest> pairs = pairwise(ratings);
  ASSERT_EQ(pairs.size(), 1u);
  EXPECT_NEAR(sut.uncorrected.f, pairs[0].t * pairs[0].t, 1e-9);
  EXPECT_NEAR(sut.uncorrected.p, pairs[0].p, 1e-9);
  EXPECT_NEAR(sut.sphericity.greenhouse_geisser, 1, 1e-12);
  EXPECT_EQ(pairs[0].p_bonferroni, pairs[0].p);
}

TEST(RepeatedMeasures, PeopleWhoAgreeExactlyLeaveNoError) {
  const RepeatedMeasures differ = repeated_measures({3, {1, 5, 9, 1, 5, 9, 1, 5, 9}});
  EXPECT_TRUE(std::isinf(differ.uncorrected.f));
  EXPECT_EQ(differ.uncorrected.p, 0);
  const RepeatedMeasures same = repeated_measures({3, {5, 5, 5, 7, 7, 7}});
  EXPECT_TRUE(std::isnan(same.uncorrected.f));
  EXPECT_EQ(same.uncorrected.p, 1);
  for (const PairTest& pair : pairwise({3, {5, 5, 5, 7, 7, 7}})) EXPECT_EQ(pair.p_bonferroni, 1);
}

TEST(Pairwise, BonferroniTimesTheNumberOfPairs) {
  std::mt19937 random(4);
  std::normal_distribution<double> normal(5, 1);
  Ratings ratings{4, {}};
  for (int i = 0; i < 80; ++i) ratings.values.push_back(normal(random));
  for (const PairTest& pair : pairwise(ratings)) {
    EXPECT_NEAR(pair.p_bonferroni, std::min(1.0, 6 * pair.p), 1e-12);
    EXPECT_LT(pair.ci95_low, pair.mean_difference);
    EXPECT_EQ(pair.ci95_low > 0 || pair.ci95_high < 0, pair.p_bonferroni < 0.05) << "interval and test say the same";
  }
}

// NEEDS of the paper's table: 8.427 needs half points, the shares need another number of people.
TEST(PrintedFigures, MeansAndSharesThatNoNumberOfPeopleGives) {
  EXPECT_TRUE(mean_is_possible(5.935, 3, 62));
  EXPECT_TRUE(mean_is_possible(3.71, 2, 62));
  EXPECT_FALSE(mean_is_possible(8.427, 3, 62));
  EXPECT_TRUE(mean_is_possible(8.427, 3, 62, 2));
  EXPECT_FALSE(percentage_is_possible(69.57, 2, 62));
  EXPECT_FALSE(percentage_is_possible(65.22, 2, 62));
  for (const std::size_t n : {23u, 46u, 69u}) {
    EXPECT_TRUE(percentage_is_possible(69.57, 2, n));
    EXPECT_TRUE(percentage_is_possible(65.22, 2, n));
  }
  for (std::size_t n = 1; n < 60; ++n)
    for (std::size_t sum = n; sum <= 10 * n; ++sum) {
      const double mean = static_cast<double>(sum) / static_cast<double>(n);
      ASSERT_TRUE(mean_is_possible(std::nearbyint(mean * 1000) / 1000, 3, n)) << sum << " of " << n;
    }
}

}  // namespace
}  // namespace tactus::firmware
