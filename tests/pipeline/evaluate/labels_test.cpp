#include "pipeline/evaluate/labels.hpp"

#include <gtest/gtest.h>

#include <random>
#include <string>

namespace tactus::evaluate {
namespace {

constexpr MaterialId kWood = 22, kFabric = 3, kGlass = 6;

TEST(LabelMetrics, HandComputedCase) {
  //              predicted wood  fabric  glass  unknown     t
  // true wood              50      10      0       0        60
  // true fabric             5      25      0      10        40
  // true glass: absent, but 0 + 0 predicted
  ConfusionMatrix sut;
  sut.add(kWood, kWood, 50);
  sut.add(kWood, kFabric, 10);
  sut.add(kFabric, kWood, 5);
  sut.add(kFabric, kFabric, 25);
  sut.add(kFabric, kUnknownMaterial, 10);
  const LabelMetrics m = label_metrics(sut);
  EXPECT_EQ(m.pixels_count, 100u);
  EXPECT_EQ(m.classes_count, 2);
  EXPECT_DOUBLE_EQ(m.pixel_accuracy, 0.75);
  EXPECT_DOUBLE_EQ(m.mean_accuracy, (50.0 / 60 + 25.0 / 40) / 2);
  EXPECT_DOUBLE_EQ(m.iu[kWood], 50.0 / (60 + 55 - 50));
  EXPECT_DOUBLE_EQ(m.iu[kFabric], 25.0 / (40 + 35 - 25));
  EXPECT_DOUBLE_EQ(m.mean_iu, (50.0 / 65 + 25.0 / 50) / 2);
  EXPECT_DOUBLE_EQ(m.frequency_weighted_iu, (60 * 50.0 / 65 + 40 * 25.0 / 50) / 100);
  EXPECT_DOUBLE_EQ(m.predicted_share, 0.9);
}

TEST(LabelMetrics, ClassesAbsentFromTruthAreLeftOutOfTheMeans) {
  ConfusionMatrix sut;
  sut.add(kWood, kWood, 8);
  sut.add(kWood, kGlass, 2);  // glass never occurs: its IU of 0 must not halve the mean
  const LabelMetrics m = label_metrics(sut);
  EXPECT_EQ(m.classes_count, 1);
  EXPECT_DOUBLE_EQ(m.mean_iu, 0.8);
  EXPECT_DOUBLE_EQ(m.mean_accuracy, 0.8);
}

TEST(LabelMetrics, PerfectPredictionIsOneEverywhere) {
  ConfusionMatrix sut;
  for (int i = 0; i < kMaterialCount; ++i) {
    sut.add(static_cast<MaterialId>(i), static_cast<MaterialId>(i), static_cast<std::uint64_t>(i) + 1);
  }
  const LabelMetrics m = label_metrics(sut);
  EXPECT_DOUBLE_EQ(m.pixel_accuracy, 1);
  EXPECT_DOUBLE_EQ(m.mean_accuracy, 1);
  EXPECT_DOUBLE_EQ(m.mean_iu, 1);
  EXPECT_DOUBLE_EQ(m.frequency_weighted_iu, 1);
}

TEST(LabelMetrics, UnknownTruthIsNotCountedAndNothingIsZero) {
  ConfusionMatrix sut;
  sut.add(kUnknownMaterial, kWood, 1000);
  sut.add(23, kWood, 1000);
  const LabelMetrics m = label_metrics(sut);
  EXPECT_EQ(m.pixels_count, 0u);
  EXPECT_EQ(m.classes_count, 0);
  EXPECT_EQ(m.pixel_accuracy, 0);
}

TEST(LabelMetrics, AgreesWithCountingPixelByPixel) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> id(0, kMaterialCount);  // kMaterialCount stands for unknown
  std::vector<int> truth(5000), predicted(5000);
  ConfusionMatrix sut;
  for (std::size_t p = 0; p < truth.size(); ++p) {
    truth[p] = id(random);
    predicted[p] = random() % 2 == 0 ? truth[p] : id(random);
    sut.add(static_cast<MaterialId>(truth[p]), static_cast<MaterialId>(predicted[p]));
  }
  double mean_iu = 0, correct = 0, total = 0;
  for (int c = 0; c < kMaterialCount; ++c) {
    double both = 0, either = 0;
    for (std::size_t p = 0; p < truth.size(); ++p) {
      if (truth[p] == kMaterialCount) continue;
      both += truth[p] == c && predicted[p] == c;
      either += truth[p] == c || predicted[p] == c;
      total += c == 0;
    }
    mean_iu += both / either / kMaterialCount;
    correct += both;
  }
  const LabelMetrics m = label_metrics(sut);
  EXPECT_NEAR(m.mean_iu, mean_iu, 1e-12);
  EXPECT_NEAR(m.pixel_accuracy, correct / total, 1e-12);
}

}  // namespace
}  // namespace tactus::evaluate
