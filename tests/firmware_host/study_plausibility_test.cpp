// Shares, intervals and tests of `study plausibility`, against published figures and sums over all outcomes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <vector>

#include "firmware_host/plausibility.hpp"
#include "firmware_host/study_text.hpp"

namespace tactus::firmware {
namespace {

using enum contact::Outcome;

TEST(Wilson95, IsThatOfNewcombesTable) {
  // Newcombe (1998), Statistics in Medicine 17, table I, method 3.
  const struct {
    std::size_t successes, n;
    double low, high;
  } cases[] = {
      {81, 263, 0.2553, 0.3662}, {15, 148, 0.0624, 0.1605}, {0, 20, 0, 0.1611}, {1, 29, 0.0061, 0.1718}};
  for (const auto& c : cases) {
    const Interval sut = wilson95(c.successes, c.n);
    EXPECT_NEAR(sut.low, c.low, 0.00005) << c.successes;
    EXPECT_NEAR(sut.high, c.high, 0.00005) << c.successes;
  }
}

TEST(Wilson95, EndsAreTheSharesWhoseScoreTestJustRejects) {
  for (std::size_t n : {1u, 7u, 40u})
    for (std::size_t successes = 0; successes <= n; ++successes) {
      const double count = static_cast<double>(n), p = static_cast<double>(successes) / count;
      const Interval sut = wilson95(successes, n);
      EXPECT_LE(sut.low, p);
      EXPECT_GE(sut.high, p);
      if (successes > 0) {
        EXPECT_NEAR((p - sut.low) / std::sqrt(sut.low * (1 - sut.low) / count), 1.959964, 1e-6);
      }
      if (successes < n) {
        EXPECT_NEAR((sut.high - p) / std::sqrt(sut.high * (1 - sut.high) / count), 1.959964, 1e-6);
      }
      const Interval mirrored = wilson95(n - successes, n);
      EXPECT_NEAR(sut.low, 1 - mirrored.high, 1e-15);
    }
  EXPECT_EQ(wilson95(0, 5).low, 0.0);
  EXPECT_EQ(wilson95(5, 5).high, 1.0);
}

TEST(McNemarExact, HandComputedAndPublishedFigures) {
  EXPECT_EQ(mcnemar_exact_p(0, 0), 1);
  EXPECT_EQ(mcnemar_exact_p(3, 3), 1);
  EXPECT_DOUBLE_EQ(mcnemar_exact_p(1, 5), 14.0 / 64);  // 2 (1 + 6) / 2^6
  EXPECT_DOUBLE_EQ(mcnemar_exact_p(10, 0), 2.0 / 1024);
  // mlxtend's documentation of mcnemar, and VassarStats' calculator to six decimals.
  EXPECT_NEAR(mcnemar_exact_p(121, 59), 4.4344492637555e-06, 1e-17);
  EXPECT_NEAR(mcnemar_exact_p(70, 59), 0.378688, 5e-7);
  EXPECT_NEAR(mcnemar_exact_p(80, 59), 0.089452, 5e-7);
  EXPECT_NEAR(mcnemar_exact_p(30, 60), 0.002060, 5e-7);
  EXPECT_NEAR(mcnemar_exact_p(10, 30), 0.002221, 5e-7);
}

TEST(McNemarExact, IsTheSumOverAllOutcomesAtLeastAsRare) {
  for (std::size_t n = 1; n <= 40; ++n) {
    std::vector<double> probability(n + 1, 1);  // of a fair coin, by Pascal's rule
    for (std::size_t k = 0; k <= n; ++k) {
      for (std::size_t i = 0; i < k; ++i)
        probability[k] *= static_cast<double>(n - i) / static_cast<double>(k - i);
      probability[k] *= std::pow(0.5, static_cast<double>(n));
    }
    for (std::size_t first = 0; first <= n; ++first) {
      double sum = 0;
      for (const double p : probability) sum += p <= probability[first] * (1 + 1e-9) ? p : 0;
      EXPECT_NEAR(mcnemar_exact_p(first, n - first), sum, 1e-12) << first << " of " << n;
      EXPECT_EQ(mcnemar_exact_p(first, n - first), mcnemar_exact_p(n - first, first));
    }
  }
}

// Twelve contacts, of which `uniform` lacks one and has one of its own; counted by hand.
std::vector<PlausibilityCondition> three_conditions() {
  std::vector<PlausibilityCondition> conditions = {{"none", {}}, {"uniform", {}}, {"semantic", {}}};
  for (std::uint64_t id = 0; id < 12; ++id) {
    const contact::Outcome expected = id < 6 ? broke : id < 10 ? bounced : intact;
    conditions[0].contacts.push_back({id, expected, through});
    if (id < 11) conditions[1].contacts.push_back({id, expected, broke});
    conditions[2].contacts.push_back({id, expected, id == 0 ? broke_with_chips : expected});
  }
  conditions[1].contacts.push_back({99, through, through});
  std::reverse(conditions[1].contacts.begin(), conditions[1].contacts.end());
  return conditions;
}

TEST(Plausibility, SharesAndPairsOfTheSameContacts) {
  const auto sut = plausibility_of(three_conditions());
  ASSERT_TRUE(sut) << sut.error().message;
  ASSERT_EQ(sut->shares.size(), 3u);
  const std::size_t n[] = {12, 12, 12}, matches[] = {0, 7, 11};
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(sut->shares[i].n, n[i]);
    EXPECT_EQ(sut->shares[i].matches, matches[i]);
    EXPECT_DOUBLE_EQ(sut->shares[i].share, static_cast<double>(matches[i]) / 12);
  }
  EXPECT_NEAR(sut->shares[0].ci95.high, 0.2425, 0.0001);  // z^2 / (n + z^2)
  EXPECT_EQ(
      sut->shares[2].counts[static_cast<std::size_t>(broke)][static_cast<std::size_t>(broke_with_chips)], 1u);
  EXPECT_EQ(sut->shares[2].counts[static_cast<std::size_t>(bounced)][static_cast<std::size_t>(bounced)], 4u);

  ASSERT_EQ(sut->pairs.size(), 3u);
  const ConditionPair &none_uniform = sut->pairs[0], &none_semantic = sut->pairs[1],
                      &uniform_semantic = sut->pairs[2];
  EXPECT_EQ(none_uniform.n, 11u);
  EXPECT_EQ(none_uniform.only_first, 0u);
  EXPECT_EQ(none_uniform.only_second, 6u);
  EXPECT_DOUBLE_EQ(none_uniform.p, 2.0 / 64);
  EXPECT_DOUBLE_EQ(none_uniform.p_bonferroni, 6.0 / 64);
  EXPECT_EQ(none_semantic.n, 12u);
  EXPECT_DOUBLE_EQ(none_semantic.p, 2.0 / 2048);
  EXPECT_EQ(uniform_semantic.n, 11u);
  EXPECT_EQ(uniform_semantic.only_first, 1u);   // contact 0
  EXPECT_EQ(uniform_semantic.only_second, 5u);  // 6 to 10
  EXPECT_DOUBLE_EQ(uniform_semantic.p, 14.0 / 64);
}

TEST(Plausibility, IsTheSameInAnyOrderOfContacts) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    std::mt19937 random(seed);
    auto conditions = three_conditions();
    const auto expected = plausibility_of(conditions);
    for (auto& condition : conditions)
      std::shuffle(condition.contacts.begin(), condition.contacts.end(), random);
    const auto sut = plausibility_of(conditions);
    ASSERT_TRUE(sut && expected);
    EXPECT_EQ(plausibility_json(*sut), plausibility_json(*expected)) << "seed " << seed;
  }
}

TEST(Plausibility, TextAndJsonSayTheSame) {
  const auto sut = plausibility_of(three_conditions());
  ASSERT_TRUE(sut);
  const std::string text = plausibility_text(*sut);
  for (const char* part :
       {"  none                  12            0        0.0     0.0 to 24.2\n",
        "  semantic              12           11       91.7    64.6 to 98.5\n",
        "  none - uniform: -54.5 points; of 11, 0 as expected in none only, 6 in uniform only, p = .094\n",
        "  none - semantic: -91.7 points; of 12, 0 as expected in none only, 11 in semantic only, p = .003\n",
        "semantic: what was expected (rows) and what came (columns)\n",
        "  broke                              0                 0                 0                 5                 1\n"})
    EXPECT_NE(text.find(part), std::string::npos) << part << "\n" << text;
  const auto json = plausibility_json(*sut);
  EXPECT_EQ(json["conditions"][2]["as_expected"], 11);
  EXPECT_EQ(json["conditions"][2]["outcomes"]["broke"]["broke with chips"], 1);
  EXPECT_EQ(json["pairs"][0]["only_second"], 6);
  EXPECT_DOUBLE_EQ(json["pairs"][0]["p"], 6.0 / 64);
  EXPECT_NEAR(json["conditions"][2]["ci95"][0], 0.6461, 0.0001);
}

TEST(Plausibility, NothingInCommonIsSaid) {
  const auto sut = plausibility_of(
      std::vector<PlausibilityCondition>{{"a", {{1, broke, broke}}}, {"b", {{2, broke, broke}}}});
  ASSERT_TRUE(sut);
  EXPECT_NE(plausibility_text(*sut).find("a - b: no contact is in both"), std::string::npos);
  EXPECT_EQ(sut->pairs[0].p, 1);
}

TEST(Plausibility, WhatIsWrongIsOneSentence) {
  const struct {
    std::vector<PlausibilityCondition> conditions;
    std::string part;
  } cases[] = {{{}, "there is no condition"},
               {{{"a", {}}}, "condition a: no contact was judged"},
               {{{"a", {{7, broke, broke}, {7, broke, intact}}}}, "condition a: contact 7 is there twice"}};
  for (const auto& [conditions, part] : cases) {
    const auto sut = plausibility_of(conditions);
    ASSERT_FALSE(sut);
    EXPECT_EQ(sut.error().code, rt::ExitCode::bad_input);
    EXPECT_NE(sut.error().message.find(part), std::string::npos) << sut.error().message;
  }
}

TEST(StudyText, PValuesAreNeverRoundedToNothing) {
  EXPECT_EQ(p_text(0.00099), "p < .001");
  EXPECT_EQ(p_text(0.0421), "p = .042");
  EXPECT_EQ(p_text(0.9994), "p = .999");
  EXPECT_EQ(p_text(0.9996), "p = 1.000");
  EXPECT_EQ(p_text(1), "p = 1.000");
}

}  // namespace
}  // namespace tactus::firmware
