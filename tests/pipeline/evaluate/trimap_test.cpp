#include "pipeline/evaluate/trimap.hpp"

#include <gtest/gtest.h>

#include <random>
#include <string>
#include <vector>

namespace tactus::evaluate {
namespace {

constexpr MaterialId kWood = 22, kFabric = 3;

TEST(Trimap, StraightEdgeHasABandOfTheRadiusOnEitherSide) {
  // Twelve columns, wood in the first six.
  std::vector<MaterialId> truth(12 * 3);
  for (std::size_t i = 0; i < truth.size(); ++i) truth[i] = i % 12 < 6 ? kWood : kFabric;
  std::vector<std::uint8_t> band(truth.size(), 7);
  mark_boundary_band(truth, 12, 3, 4, band);
  for (std::size_t i = 0; i < truth.size(); ++i) EXPECT_EQ(band[i], i % 12 >= 2 && i % 12 < 10 ? 1 : 0) << i;
}

TEST(Trimap, EqualsLookingAtEveryPairOfPixels) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  for (const int radius : {1, 2, 4, 5}) {
    constexpr int kWidth = 37, kHeight = 23;
    // Blobs rather than noise: discs of few ids, one of them unknown.
    std::vector<MaterialId> truth(kWidth * kHeight, kWood);
    for (int blob = 0; blob < 6; ++blob) {
      const int cx = static_cast<int>(random() % kWidth), cy = static_cast<int>(random() % kHeight),
                r = static_cast<int>(1 + random() % 6);
      const auto id = blob == 0 ? kUnknownMaterial : static_cast<MaterialId>(random() % 3);
      for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x)
          if ((x - cx) * (x - cx) + (y - cy) * (y - cy) <= r * r)
            truth[static_cast<std::size_t>(y * kWidth + x)] = id;
    }
    std::vector<std::uint8_t> band(truth.size());
    mark_boundary_band(truth, kWidth, kHeight, radius, band);
    for (int p = 0; p < kWidth * kHeight; ++p) {
      bool is_near = false;
      for (int q = 0; q < kWidth * kHeight; ++q) {
        const int dx = p % kWidth - q % kWidth, dy = p / kWidth - q / kWidth;
        is_near |= dx * dx + dy * dy <= radius * radius &&
                   truth[static_cast<std::size_t>(q)] != truth[static_cast<std::size_t>(p)];
      }
      ASSERT_EQ(band[static_cast<std::size_t>(p)], is_near ? 1 : 0) << "pixel " << p << " radius " << radius;
    }
  }
}

TEST(Trimap, CountsTheBandApartFromTheRest) {
  const std::vector<MaterialId> truth = {kWood, kWood, kWood, kFabric, kFabric, kFabric, kUnknownMaterial};
  const std::vector<MaterialId> predicted = {kWood,   kFabric, kFabric, kFabric, kUnknownMaterial,
                                             kFabric, kWood};
  const std::vector<std::uint8_t> band = {0, 0, 1, 1, 1, 0, 1};
  TrimapConfusion sut;
  count_pixels(truth, predicted, band, sut);
  // In the band: wood 0 of 1, fabric 1 of 2 (one of them without a prediction).
  EXPECT_DOUBLE_EQ(label_metrics(sut.band).pixel_accuracy, 1.0 / 3);
  EXPECT_DOUBLE_EQ(label_metrics(sut.band).mean_accuracy, 0.25);
  EXPECT_DOUBLE_EQ(label_metrics(sut.band).mean_iu, (0.0 / 2 + 1.0 / 3) / 2);
  // Away from it: wood 1 of 2, fabric 1 of 1.
  EXPECT_DOUBLE_EQ(label_metrics(sut.inside).mean_iu, (1.0 / 2 + 1.0 / 2) / 2);
  EXPECT_EQ(label_metrics(sut.all).pixels_count, 6u);
  EXPECT_DOUBLE_EQ(label_metrics(sut.all).pixel_accuracy, 0.5);
  TrimapConfusion twice;
  twice.add(sut);
  twice.add(sut);
  EXPECT_EQ(twice.band.count(kFabric, kFabric), 2u);
  EXPECT_EQ(twice.inside.count(kWood, kFabric), 2u);
  EXPECT_EQ(twice.all.unknown_count(kFabric), 2u);
}

}  // namespace
}  // namespace tactus::evaluate
