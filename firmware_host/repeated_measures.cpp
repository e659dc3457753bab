#include "firmware_host/repeated_measures.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/fisher_f.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <limits>

#include "rt/assert.hpp"

namespace tactus::firmware {
namespace {

using Matrix = Eigen::MatrixXd;

Matrix matrix_of(const Ratings& ratings) {
  return Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
      ratings.values.data(), static_cast<Eigen::Index>(ratings.participants_count()),
      static_cast<Eigen::Index>(ratings.conditions_count));
}

/// Orthonormal contrasts of k conditions (Helmert), one a column: all that the conditions differ in.
Matrix contrasts_of(Eigen::Index k) {
  Matrix contrasts = Matrix::Zero(k, k - 1);
  for (Eigen::Index c = 1; c < k; ++c) {
    const auto n = static_cast<double>(c);
    contrasts.col(c - 1).head(c).setConstant(1 / std::sqrt(n * (n + 1)));
    contrasts(c, c - 1) = -n / std::sqrt(n * (n + 1));
  }
  return contrasts;
}

double two_sided_p(double t, double df) {
  if (!std::isfinite(t)) return 0;
  return 2 * boost::math::cdf(boost::math::complement(boost::math::students_t(df), std::fabs(t)));
}

double t_quantile(double df, double upper_tail) {
  return boost::math::quantile(boost::math::complement(boost::math::students_t(df), upper_tail));
}

/// Bartlett's factor between -ln W and chi2.
double bartlett(double df_error, double p) { return df_error - (2 * p * p + p + 2) / (6 * p); }

/// Of the contrasts' covariance, with df_error degrees of freedom behind it.
Sphericity sphericity_of(const Matrix& covariance, double df_error) {
  Sphericity s;
  const auto p = static_cast<double>(covariance.rows());
  const double trace = covariance.trace(), squares = covariance.squaredNorm();
  if (!(trace > 0)) return s;
  s.greenhouse_geisser = trace * trace / (p * squares);
  const double n = df_error + 1, e = s.greenhouse_geisser;
  const double denominator = p * (n - 1 - p * e);
  s.huynh_feldt = denominator > 0 ? std::min(1.0, (n * p * e - 2) / denominator) : 1.0;
  if (covariance.rows() < 2) return s;  // two conditions have one difference
  s.w = covariance.determinant() / std::pow(trace / p, p);
  s.df = p * (p + 1) / 2 - 1;
  s.chi2 = s.w > 0 ? std::max(0.0, -bartlett(df_error, p) * std::log(s.w)) : std::numeric_limits<double>::infinity();
  s.p = std::isfinite(s.chi2) ? boost::math::cdf(boost::math::complement(boost::math::chi_squared(s.df), s.chi2)) : 0;
  return s;
}

/// A sum of squares, 0 where it is what rounding leaves of one that is 0: some 1e-31 of the ratings' own squares. The
/// least that can be meant, a hundredth of a point by one of thousands, is 1e-10 of them.
double beyond_rounding(double squares, double squares_of_ratings) {
  return squares > 1e-20 * squares_of_ratings ? squares : 0;
}

double ratio(double effect, double df_effect, double error, double df_error) {
  return effect / df_effect / (error / df_error);
}

}  // namespace

Spread spread_of(std::span<const double> values) {
  TACTUS_ASSERT(values.size() >= 2);
  Spread s;
  s.n = values.size();
  const auto n = static_cast<double>(s.n);
  for (const double v : values) s.mean += v / n;
  double squares = 0;
  for (const double v : values) squares += (v - s.mean) * (v - s.mean);
  s.sd = std::sqrt(squares / (n - 1));
  const double half = t_quantile(n - 1, 0.025) * s.sd / std::sqrt(n);
  s.ci95_low = s.mean - half;
  s.ci95_high = s.mean + half;
  return s;
}

FTest f_test(double f, double df_effect, double df_error) {
  FTest test{f, df_effect, df_error, 1};
  if (std::isnan(f)) return test;  // nothing differs and nothing varies
  test.p = std::isinf(f)
               ? 0
               : boost::math::cdf(boost::math::complement(boost::math::fisher_f(df_effect, df_error), std::max(f, 0.0)));
  return test;
}

double mauchly_w_of(double chi2, std::size_t participants_count, std::size_t conditions_count) {
  const auto p = static_cast<double>(conditions_count - 1);
  return std::exp(-chi2 / bartlett(static_cast<double>(participants_count - 1), p));
}

RepeatedMeasures repeated_measures(const Ratings& ratings) {
  const std::size_t n = ratings.participants_count(), k = ratings.conditions_count;
  TACTUS_ASSERT(n >= 2 && k >= 2);
  const Matrix y = matrix_of(ratings);
  const auto nd = static_cast<double>(n), kd = static_cast<double>(k);
  const double grand = y.mean();
  const Eigen::VectorXd of_participant = y.rowwise().mean();
  const Eigen::RowVectorXd of_condition = y.colwise().mean();
  RepeatedMeasures r;
  const double all = y.squaredNorm();
  r.ss_conditions = beyond_rounding(nd * (of_condition.array() - grand).square().sum(), all);
  r.ss_participants = kd * (of_participant.array() - grand).square().sum();
  const Matrix error = (y.colwise() - of_participant).rowwise() - (of_condition.array() - grand).matrix();
  r.ss_error = beyond_rounding(error.squaredNorm(), all);
  const double df_effect = kd - 1, df_error = df_effect * (nd - 1);
  const double f = ratio(r.ss_conditions, df_effect, r.ss_error, df_error);
  const Matrix differences = y * contrasts_of(static_cast<Eigen::Index>(k));
  const Matrix centred = differences.rowwise() - differences.colwise().mean();
  if (r.ss_error > 0) r.sphericity = sphericity_of(centred.transpose() * centred / (nd - 1), nd - 1);
  r.uncorrected = f_test(f, df_effect, df_error);
  const double epsilon = r.sphericity.greenhouse_geisser;
  r.corrected = f_test(f, df_effect * epsilon, df_error * epsilon);
  r.partial_eta2 = r.ss_conditions / (r.ss_conditions + r.ss_error);
  return r;
}

std::vector<PairTest> pairwise(const Ratings& ratings) {
  const std::size_t n = ratings.participants_count(), k = ratings.conditions_count;
  const auto tests_count = static_cast<double>(k * (k - 1) / 2);
  std::vector<PairTest> tests;
  std::vector<double> difference(n);
  for (std::size_t a = 0; a < k; ++a)
    for (std::size_t b = a + 1; b < k; ++b) {
      double all = 0;
      for (std::size_t s = 0; s < n; ++s) {
        difference[s] = ratings.at(s, a) - ratings.at(s, b);
        all += ratings.at(s, a) * ratings.at(s, a) + ratings.at(s, b) * ratings.at(s, b);
      }
      Spread spread = spread_of(difference);
      if (beyond_rounding(spread.sd * spread.sd, all) == 0) spread.sd = 0;
      if (beyond_rounding(spread.mean * spread.mean, all) == 0) spread.mean = 0;
      const double df = static_cast<double>(n - 1), error = spread.sd / std::sqrt(static_cast<double>(n));
      PairTest test{a, b, spread.mean, 0, 0, 0, df, 1, 1};
      if (error > 0 || spread.mean != 0) {
        test.t = spread.mean / error;
        test.p = two_sided_p(test.t, df);
      }
      test.p_bonferroni = std::min(1.0, test.p * tests_count);
      const double half = t_quantile(df, 0.025 / tests_count) * error;
      test.ci95_low = spread.mean - half;
      test.ci95_high = spread.mean + half;
      tests.push_back(test);
    }
  return tests;
}

MixedAnova mixed_anova(const Ratings& ratings, std::span<const std::size_t> group, std::size_t groups_count) {
  const std::size_t n = ratings.participants_count();
  TACTUS_ASSERT(group.size() == n && groups_count >= 2 && n > groups_count + 1);
  const Matrix y = matrix_of(ratings);
  const auto k = y.cols();
  const auto kd = static_cast<double>(k), g = static_cast<double>(groups_count), nd = static_cast<double>(n);
  const Eigen::VectorXd of_participant = y.rowwise().mean();
  const Matrix differences = y * contrasts_of(k);
  std::vector<double> size(groups_count, 0);
  Eigen::VectorXd mean_of_group = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(groups_count));
  Matrix differences_of_group = Matrix::Zero(static_cast<Eigen::Index>(groups_count), k - 1);
  for (std::size_t s = 0; s < n; ++s) {
    const auto at = static_cast<Eigen::Index>(group[s]), row = static_cast<Eigen::Index>(s);
    size[group[s]] += 1;
    mean_of_group(at) += of_participant(row);
    differences_of_group.row(at) += differences.row(row);
  }
  double inverse_sizes = 0;
  for (std::size_t i = 0; i < groups_count; ++i) {
    TACTUS_ASSERT(size[i] > 0);
    mean_of_group(static_cast<Eigen::Index>(i)) /= size[i];
    differences_of_group.row(static_cast<Eigen::Index>(i)) /= size[i];
    inverse_sizes += 1 / size[i];
  }
  double ss_between = 0, ss_participants = 0, ss_interaction = 0;
  const double grand = of_participant.mean();
  const Eigen::RowVectorXd differences_mean = differences.colwise().mean();
  for (std::size_t i = 0; i < groups_count; ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    ss_between += kd * size[i] * (mean_of_group(at) - grand) * (mean_of_group(at) - grand);
    ss_interaction += size[i] * (differences_of_group.row(at) - differences_mean).squaredNorm();
  }
  Matrix within(differences.rows(), k - 1);
  for (std::size_t s = 0; s < n; ++s) {
    const auto at = static_cast<Eigen::Index>(group[s]), row = static_cast<Eigen::Index>(s);
    const double off = of_participant(row) - mean_of_group(at);
    ss_participants += kd * off * off;
    within.row(row) = differences.row(row) - differences_of_group.row(at);
  }
  // Type III: each contrast's mean of group means, whatever the groups' sizes.
  const double all = y.squaredNorm(), df_participants = nd - g;
  const double ss_conditions =
      beyond_rounding(differences_of_group.colwise().mean().squaredNorm() / (inverse_sizes / (g * g)), all);
  const double ss_error = beyond_rounding(within.squaredNorm(), all);
  ss_between = beyond_rounding(ss_between, all);
  ss_participants = beyond_rounding(ss_participants, all);
  ss_interaction = beyond_rounding(ss_interaction, all);
  MixedAnova anova;
  if (ss_error > 0)
    anova.epsilon =
        sphericity_of(within.transpose() * within / df_participants, df_participants).greenhouse_geisser;
  const double df_error = (kd - 1) * df_participants, e = anova.epsilon;
  anova.between = f_test(ratio(ss_between, g - 1, ss_participants, df_participants), g - 1, df_participants);
  anova.conditions = f_test(ratio(ss_conditions, kd - 1, ss_error, df_error), (kd - 1) * e, df_error * e);
  const double df_interaction = (kd - 1) * (g - 1);
  anova.interaction =
      f_test(ratio(ss_interaction, df_interaction, ss_error, df_error), df_interaction * e, df_error * e);
  return anova;
}

bool mean_is_possible(double printed_mean, int decimals, std::size_t n, int steps) {
  const double shares = static_cast<double>(n) * steps, half = 0.5 * std::pow(10, -decimals) * (1 + 1e-9);
  // Nearest whole sum; its mean must round to what is printed.
  return std::fabs(std::nearbyint(printed_mean * shares) / shares - printed_mean) <= half;
}

bool percentage_is_possible(double printed, int decimals, std::size_t n) {
  return mean_is_possible(printed / 100, decimals + 2, n);
}

}  // namespace tactus::firmware
