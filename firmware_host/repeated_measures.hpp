// Analysis of variance with repeated measures, as the paper's user study used it: every participant rates every
// condition. Plain numbers in, plain numbers out; the formulas are those of Winer (1971) and Girden (1992), p-values from
// Boost.Math. Host only; no state; any thread.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace tactus::firmware {

/// Ratings [participant][condition], rows one after another.
struct Ratings {
  std::size_t conditions_count = 0;
  std::vector<double> values;
  [[nodiscard]] std::size_t participants_count() const {
    return conditions_count == 0 ? 0 : values.size() / conditions_count;
  }
  [[nodiscard]] double at(std::size_t participant, std::size_t condition) const {
    return values[participant * conditions_count + condition];
  }
};

struct Spread {
  std::size_t n = 0;
  double mean = 0, sd = 0;                 // of the sample, n - 1
  double ci95_low = 0, ci95_high = 0;  // of the mean, by Student's t
};
/// n >= 2.
[[nodiscard]] Spread spread_of(std::span<const double> values);

struct FTest {
  double f = 0, df_effect = 0, df_error = 0, p = 0;
};
/// p of an F value; degrees of freedom need not be whole.
[[nodiscard]] FTest f_test(double f, double df_effect, double df_error);

/// Mauchly (1940): are the differences between conditions equally varied? chi2 is Bartlett's approximation.
struct Sphericity {
  double w = 1, chi2 = 0, df = 0, p = 1;
  double greenhouse_geisser = 1, huynh_feldt = 1;  // epsilon
};

/// W from a printed chi2, and with three conditions (two contrasts) the Greenhouse-Geisser epsilon, which W fixes then:
/// 1 / (2 - W).
[[nodiscard]] double mauchly_w_of(double chi2, std::size_t participants_count, std::size_t conditions_count);
[[nodiscard]] inline double epsilon_of_three_conditions(double w) { return 1 / (2 - w); }

struct RepeatedMeasures {
  double ss_conditions = 0, ss_participants = 0, ss_error = 0;
  FTest uncorrected, corrected;  // the latter by Greenhouse and Geisser
  Sphericity sphericity;
  double partial_eta2 = 0;
};
/// At least 2 conditions and 2 participants. Where every participant has the same differences the error is 0 and F is
/// infinite (p 0), or NaN when the conditions do not differ either (p 1).
[[nodiscard]] RepeatedMeasures repeated_measures(const Ratings& ratings);

/// Paired t-tests of every two conditions; p and interval by Bonferroni.
struct PairTest {
  std::size_t first = 0, second = 0;
  double mean_difference = 0, ci95_low = 0, ci95_high = 0, t = 0, df = 0, p = 0, p_bonferroni = 0;
};
[[nodiscard]] std::vector<PairTest> pairwise(const Ratings& ratings);

/// One factor between participants beside: group per participant, 0 to groups_count - 1; groups may be of unequal size
/// (sums of squares of type III).
struct MixedAnova {
  FTest between, conditions, interaction;  // the latter two corrected by `epsilon`
  double epsilon = 1;                      // Greenhouse and Geisser, from the pooled covariance
};
/// Every group has at least 1 participant, and there are more participants than groups + 1.
[[nodiscard]] MixedAnova mixed_anova(const Ratings& ratings, std::span<const std::size_t> group,
                                     std::size_t groups_count);

/// Whether some whole number of `steps`-th points shared by n people has this mean when printed with `decimals` digits
/// (Brown and Heathers 2017). steps = 1: whole points.
[[nodiscard]] bool mean_is_possible(double printed_mean, int decimals, std::size_t n, int steps = 1);
/// Whether some number of n people is this many per cent when printed with `decimals` digits.
[[nodiscard]] bool percentage_is_possible(double printed, int decimals, std::size_t n);

}  // namespace tactus::firmware
