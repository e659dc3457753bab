#include "pipeline/label/refined_word.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>

namespace tactus::label {
namespace {

TEST(RefinedWord, RandomMarginalsKeepTheBestTwoAndTheirShares) {
  std::mt19937 random(11);
  std::uniform_real_distribution<float> unit(0, 1);
  for (int round = 0; round < 2000; ++round) {
    MaterialDistribution p{};
    for (float& v : p) v = unit(random) * unit(random) * unit(random);
    p[random() % p.size()] += static_cast<float>(round % 5);
    const float sum = std::accumulate(p.begin(), p.end(), 0.0F);
    const RefinedWord word = refined_word(p);
    ASSERT_NE(word, 0U);
    ASSERT_LT(word, 1U << 24);
    const auto best = static_cast<std::size_t>(std::max_element(p.begin(), p.end()) - p.begin());
    ASSERT_EQ(refined_best(word), best);
    MaterialDistribution q{};
    refined_decode(word, q);
    EXPECT_NEAR(std::accumulate(q.begin(), q.end(), 0.0F), 1.0F, 1e-5F);
    EXPECT_NEAR(q[best], p[best] / sum, 0.5F / 127 + 1e-5F);
    EXPECT_FLOAT_EQ(q[best], refined_confidence(word));
    MaterialDistribution rest = p;
    rest[best] = -1;
    const auto second = static_cast<std::size_t>(std::max_element(rest.begin(), rest.end()) - rest.begin());
    EXPECT_NEAR(q[second], p[second] / sum, 1.0F / 127 + 1e-5F);
  }
}

TEST(RefinedWord, EvenMarginalsGiveTheLowestIdAndNeverTheEmptyWord) {
  MaterialDistribution p;
  p.fill(1.0F);
  const RefinedWord word = refined_word(p);
  EXPECT_NE(word, 0U);
  EXPECT_EQ(refined_best(word), 0);
  EXPECT_EQ(refined_best(0), kUnknownMaterial);
  EXPECT_EQ(refined_confidence(0), 0.0F);
}

TEST(RefinedWord, CertaintyKeepsAllOfItsMass) {
  for (MaterialId m = 0; m < kMaterialCount; ++m) {
    MaterialDistribution p{};
    p[m] = 0.3F;
    MaterialDistribution q{};
    refined_decode(refined_word(p), q);
    EXPECT_EQ(refined_best(refined_word(p)), m);
    EXPECT_NEAR(q[m], 1.0F, 1e-6F);
  }
}

}  // namespace
}  // namespace tactus::label
