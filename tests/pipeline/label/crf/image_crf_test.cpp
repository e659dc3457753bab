#include "pipeline/label/crf/image_crf.hpp"

#include <gtest/gtest.h>

#include <cstdio>
#include <cstring>

#include "pipeline/label/cost_tables.hpp"
#include "pipeline/label/crf/brute_crf.hpp"
#include "tests/pipeline/label/crf/clouds.hpp"

namespace tactus::label::test {
namespace {

// A picture of coloured stripes, what a network says of it (coarse, with errors), and the truth.
struct Picture {
  int width, height;
  std::vector<std::uint8_t> rgb, probability;
  std::vector<MaterialId> truth;
};

Picture stripes(std::uint32_t seed, int width, int height, double wrong_share) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> u(0, 1);
  std::normal_distribution<double> g;
  constexpr std::array<MaterialId, 3> kLabel{3, 12, 22};
  constexpr std::array<Rgb8, 3> kColor{Rgb8{200, 60, 60}, Rgb8{90, 160, 80}, Rgb8{60, 70, 190}};
  Picture picture{width, height, {}, {}, {}};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const auto k = static_cast<std::size_t>((x + y / 3) * 3 / (width + height / 3));
      const Rgb8 c = kColor[k];
      for (const int channel : {c.r, c.g, c.b}) picture.rgb.push_back(to_byte(channel + 5 * g(random)));
      picture.truth.push_back(kLabel[k]);
      const std::size_t said = u(random) < wrong_share ? random() % kMaterialCount : kLabel[k];
      for (std::size_t l = 0; l < kMaterialCount; ++l)
        picture.probability.push_back(static_cast<std::uint8_t>(l == said ? 80 : 8));
    }
  return picture;
}

ImageCrfParameters small_picture_parameters() {
  ImageCrfParameters p = crf_rnn_parameters(500);
  p.smoothness = {2.0F, 2.0F};
  p.appearance = {4.0F, 6.0F, 20.0F};
  return p;
}

struct Refined {
  Refined(const Picture& picture, const ImageCrfParameters& parameters)
      : Refined(picture, parameters, ImageCrfConfig::for_image(picture.width, picture.height)) {}
  Refined(const Picture& picture, const ImageCrfParameters& parameters, const ImageCrfConfig& config)
      : memory(ImageCrf::bytes_needed(config)), marginals(picture.probability.size(), -1.0F) {
    rt::Slice slice = memory.slice();
    sut.bind(slice, config);
    left_over_bytes = slice.bytes_left();
    status = sut.refine(picture.probability, picture.rgb, picture.width, picture.height, parameters,
                        marginals, report);
  }
  Memory memory;
  ImageCrf sut;
  std::size_t left_over_bytes = 0;
  std::vector<float> marginals;
  CrfReport report;
  rt::Status status = rt::Status::ok;
};

// The same problem for the 3D oracle: pixels as positions in a plane, and a surface kernel of no weight.
std::vector<double> brute_marginals(const Picture& picture, const ImageCrfParameters& p) {
  Cloud cloud;
  for (std::size_t i = 0; i < picture.truth.size(); ++i) {
    const auto w = static_cast<std::size_t>(picture.width);
    cloud.add({static_cast<float>(i % w), static_cast<float>(i / w), 0},
              {picture.rgb[3 * i], picture.rgb[3 * i + 1], picture.rgb[3 * i + 2]}, {0, 0, 1},
              picture.truth[i]);
    for (std::size_t l = 0; l < kMaterialCount; ++l)
      cloud.unary_nat.push_back(static_cast<float>(kCostOfByte[picture.probability[i * kMaterialCount + l]]) /
                                kCostsPerNat);
  }
  CrfParameters same = default_crf_parameters();
  same.smoothness = {p.smoothness.weight, p.smoothness.theta_position_px};
  same.appearance = {p.appearance.weight, p.appearance.theta_position_px, p.appearance.theta_color};
  same.surface.weight = 0;
  same.iterations_max = p.iterations_max;
  same.settled_change = p.settled_change;
  same.normalisation = p.normalisation;
  const Memory memory(BruteCrf::bytes_needed(kBrutePointsMax));
  rt::Slice slice = memory.slice();
  BruteCrf brute;
  brute.bind(slice, kBrutePointsMax);
  EXPECT_EQ(brute.prepare(cloud.points(), same), rt::Status::ok);
  std::vector<double> marginals(cloud.unary_nat.size());
  brute.solve(marginals);
  return marginals;
}

std::size_t count_wrong(const std::vector<float>& marginals, const std::vector<MaterialId>& truth) {
  std::vector<MaterialId> labels(truth.size());
  most_probable(marginals, labels);
  std::size_t wrong = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) wrong += labels[i] != truth[i];
  return wrong;
}

TEST(ImageCrf, AgreesWithBruteForceOnASmallPicture) {
  for (const std::uint32_t seed : {1U, 2U, 3U})
    for (const CrfNormalisation normalisation : {CrfNormalisation::symmetric, CrfNormalisation::per_point}) {
      const Picture picture = stripes(seed, 24, 20, 0.3);
      ImageCrfParameters p = small_picture_parameters();
      p.normalisation = normalisation;
      const Refined sut(picture, p);
      ASSERT_EQ(sut.status, rt::Status::ok);
      const Difference d = compare(sut.marginals, brute_marginals(picture, p));
      std::printf(
          "image - brute, stripes, seed %u: total variation mean %.4f, largest |difference| %.3f, same "
          "winner %.2f %%\n",
          seed, d.mean, d.largest, 100 * d.same_winner_share);
      EXPECT_LT(d.mean, 0.02);
      EXPECT_GE(d.same_winner_share, 0.98);
    }
}

TEST(ImageCrf, IslandsOfWrongPixelsGo) {
  const Picture picture = stripes(4, 96, 64, 0.3);
  ImageCrfParameters p = small_picture_parameters();
  p.iterations_max = 0;
  const Refined before(picture, p);
  p.iterations_max = 10;
  const Refined after(picture, p);
  ASSERT_EQ(after.status, rt::Status::ok);
  EXPECT_GT(count_wrong(before.marginals, picture.truth), 1500U);
  EXPECT_LT(count_wrong(after.marginals, picture.truth), 60U);
}

TEST(ImageCrf, CostsAndBytesThatMeanTheSameGiveTheSameBits) {
  const Picture picture = stripes(5, 40, 30, 0.3);
  Refined bytes(picture, small_picture_parameters());
  std::vector<float> costs, marginals(picture.probability.size());
  for (const std::uint8_t b : picture.probability)
    costs.push_back(static_cast<float>(kCostOfByte[b]) / kCostsPerNat);
  CrfReport report;
  ASSERT_EQ(bytes.sut.refine_costs(costs, picture.rgb, 40, 30, small_picture_parameters(), marginals, report),
            rt::Status::ok);
  EXPECT_EQ(std::memcmp(marginals.data(), bytes.marginals.data(), marginals.size() * sizeof(float)), 0);
}

TEST(ImageCrf, FullAndBadParametersAreDefined) {
  const Picture picture = stripes(6, 40, 30, 0.3);
  ImageCrfConfig small = ImageCrfConfig::for_image(39, 30), few = ImageCrfConfig::for_image(40, 30);
  few.appearance_vertices_max = 30;
  const Refined too_large(picture, small_picture_parameters(), small),
      too_few(picture, small_picture_parameters(), few);
  EXPECT_EQ(too_large.status, rt::Status::full);
  EXPECT_EQ(too_few.status, rt::Status::full);
  EXPECT_EQ(too_few.marginals[0], -1.0F) << "untouched";
  ImageCrfParameters flat = small_picture_parameters();
  flat.appearance.theta_color = 0;
  EXPECT_EQ(Refined(picture, flat).status, rt::Status::corrupt);
  EXPECT_EQ(Refined(stripes(7, 0, 0, 0), small_picture_parameters(), few).status, rt::Status::ok)
      << "no pixel";
}

TEST(ImageCrf, BytesNeededAreWhatBindTakes) {
  EXPECT_EQ(Refined(stripes(8, 20, 10, 0), small_picture_parameters()).left_over_bytes, 0U);
}

}  // namespace
}  // namespace tactus::label::test
