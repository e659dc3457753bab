#include "pipeline/segment/segmenter.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "tests/pipeline/segment/bound_network.hpp"

namespace tactus::segment::test {
namespace {

ClassMap map_of(std::size_t classes, float temperature = 1) {
  ClassMap map;
  map.file = "map.toml";
  map.temperature = temperature;
  map.mean = {127, 127, 127};
  map.std = {127.5F, 127.5F, 127.5F};
  for (std::size_t c = 0; c < classes; ++c) {
    map.class_names.push_back("class" + std::to_string(c));
    MaterialDistribution materials{};
    materials[c % kMaterialCount] = 0.75F;
    materials[(c * 7 + 3) % kMaterialCount] += 0.25F;
    map.materials.push_back(materials);
  }
  return map;
}

class Bound {
 public:
  Bound(FileBytes bytes, ClassMap class_map, int width, int height)
      : bytes_(std::move(bytes)),
        map_(std::move(class_map)),
        model_(read_tflite(bytes_, "net.tflite").value()) {
    const SegmenterConfig config{&model_, &map_, width, height};
    memory_ = std::make_unique<Memory>(Segmenter::bytes_needed(config).value());
    sut_ = std::make_unique<Segmenter>(Segmenter::bind(config, memory_->slice()).value());
    out_memory_ =
        std::make_unique<Memory>(MaterialScores::bytes_needed(sut_->scores_width(), sut_->scores_height()));
    rt::Slice slice = out_memory_->slice();
    out = MaterialScores::take(slice, sut_->scores_width(), sut_->scores_height());
  }
  Segmenter& sut() { return *sut_; }
  const ClassMap& map() const { return map_; }
  MaterialScores out;

 private:
  FileBytes bytes_;
  ClassMap map_;
  Model model_;
  std::unique_ptr<Memory> memory_, out_memory_;
  std::unique_ptr<Segmenter> sut_;
};

std::vector<std::uint8_t> random_image(int width, int height, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::vector<std::uint8_t> image(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 3);
  for (std::uint8_t& v : image) v = static_cast<std::uint8_t>(random());
  return image;
}

void expect_softmax_of_scores(Bound& bound) {
  const std::vector<double> scores = BoundNetwork::values(bound.sut().network().scores());
  const TensorView& view = bound.sut().network().scores();
  const std::size_t classes = bound.map().materials.size();
  for (std::size_t p = 0; p < scores.size() / classes; ++p) {
    std::vector<double> weight(classes);
    double best = -1e9, sum = 0;
    for (std::size_t c = 0; c < classes; ++c) {
      const double q = scores[p * classes + c];
      weight[c] =
          view.type == ElementType::float32 ? q : (q - view.zero_point) * static_cast<double>(view.scale);
      best = std::max(best, weight[c]);
    }
    for (double& w : weight) sum += w = std::exp((w - best) / static_cast<double>(bound.map().temperature));
    for (std::size_t m = 0; m < kMaterialCount; ++m) {
      double expected = 0;
      for (std::size_t c = 0; c < classes; ++c)
        expected += weight[c] / sum * static_cast<double>(bound.map().materials[c][m]);
      ASSERT_NEAR(bound.out.probability[p * kMaterialCount + m], 255 * expected, 0.55)
          << "pixel " << p << " material " << m;
    }
  }
}

TEST(Segmenter, ProbabilitiesAreTheSoftmaxOfScoresMixedThroughTheMap) {
  for (const float temperature : {0.5F, 1.0F, 3.0F}) {
    Bound bound(miniature(3, 30), map_of(30, temperature), 48, 32);
    ASSERT_EQ(bound.sut().step(random_image(48, 32, 1), bound.out), rt::Status::ok);
    expect_softmax_of_scores(bound);
  }
}

FileBytes float_network() {
  ModelBuilder b;
  RandomWeights w(8);
  const int image = b.real({1, 16, 16, 3}), scores = b.real({1, 8, 8, 6});
  b.conv(image, w.filter_f32(b, {6, 3, 3, 3}, 1), -1, scores, tflite::Padding::SAME, 2);
  return b.finish({image}, {scores});
}

TEST(Segmenter, FloatScoresGoThroughTheSameSoftmax) {
  Bound bound(float_network(), map_of(6, 0.7F), 20, 30);
  ASSERT_EQ(bound.sut().step(random_image(20, 30, 2), bound.out), rt::Status::ok);
  expect_softmax_of_scores(bound);
}

TEST(Segmenter, ImageOfNetworkSizeReachesTheNetworkUnchanged) {
  Bound bound(miniature(3), map_of(5), 48, 32);
  const std::vector<std::uint8_t> image = random_image(48, 32, 4);
  ASSERT_EQ(bound.sut().step(image, bound.out), rt::Status::ok);
  const std::vector<double> through_stage = BoundNetwork::values(bound.sut().network().scores());
  BoundNetwork direct(miniature(3));
  std::memcpy(direct.network().input().bytes.data(), image.data(), image.size());
  ASSERT_EQ(direct.network().invoke(), rt::Status::ok);
  EXPECT_EQ(BoundNetwork::values(direct.network().scores()), through_stage);
}

TEST(Segmenter, ChannelOrderAndNormalisationComeFromTheMap) {
  ClassMap bgr = map_of(5);
  bgr.is_bgr = true;
  bgr.mean = {10, 127, 127};
  bgr.std = {127.5F, 63.75F, 127.5F};
  Bound bound(miniature(3), bgr, 48, 32);
  const std::vector<std::uint8_t> image = random_image(48, 32, 4);
  ASSERT_EQ(bound.sut().step(image, bound.out), rt::Status::ok);
  BoundNetwork direct(miniature(3));
  for (std::size_t i = 0; i < image.size(); i += 3) {
    const auto byte = [](double v) {
      return static_cast<std::byte>(static_cast<int>(std::clamp(v, 0.0, 255.0)));
    };
    direct.network().input().bytes[i] = byte(image[i + 2] - 10.0 + 127);  // network channel 0 is blue
    direct.network().input().bytes[i + 1] = byte(std::floor((image[i + 1] - 127.0) * 2 + 127 + 0.5));
    direct.network().input().bytes[i + 2] = byte(image[i]);
  }
  ASSERT_EQ(direct.network().invoke(), rt::Status::ok);
  EXPECT_EQ(BoundNetwork::values(direct.network().scores()),
            BoundNetwork::values(bound.sut().network().scores()));
}

TEST(Segmenter, SameImageGivesSameBytes) {
  Bound bound(miniature(3), map_of(5), 64, 40);
  ASSERT_EQ(bound.sut().warm_up(bound.out), rt::Status::ok);
  ASSERT_EQ(bound.sut().step(random_image(64, 40, 1), bound.out), rt::Status::ok);
  const std::vector<std::uint8_t> first(bound.out.probability.begin(), bound.out.probability.end());
  ASSERT_EQ(bound.sut().step(random_image(64, 40, 2), bound.out), rt::Status::ok);
  EXPECT_NE(std::vector<std::uint8_t>(bound.out.probability.begin(), bound.out.probability.end()), first);
  ASSERT_EQ(bound.sut().step(random_image(64, 40, 1), bound.out), rt::Status::ok);
  EXPECT_EQ(std::vector<std::uint8_t>(bound.out.probability.begin(), bound.out.probability.end()), first);
}

TEST(Segmenter, MapWithAnotherNumberOfClassesIsRefused) {
  const FileBytes bytes = miniature(3, 5);
  const auto model = read_tflite(bytes, "net.tflite");
  const ClassMap map = map_of(6);
  const auto sut = Segmenter::bytes_needed({&*model, &map, 48, 32});
  ASSERT_FALSE(sut);
  EXPECT_EQ(sut.error().code, rt::ExitCode::bad_usage);
  EXPECT_EQ(sut.error().message,
            "map.toml: maps 6 classes, but net.tflite scores 5; give the map that belongs to the network");
}

TEST(Segmenter, TooLittleMemoryIsASentence) {
  const FileBytes bytes = miniature(3, 5);
  const auto model = read_tflite(bytes, "net.tflite");
  const ClassMap map = map_of(5);
  const Memory memory(4096);
  const auto sut = Segmenter::bind({&*model, &map, 48, 32}, memory.slice());
  ASSERT_FALSE(sut);
  EXPECT_EQ(sut.error().code, rt::ExitCode::bad_usage);
}

TEST(MaterialScores, ColourPixelFindsTheScorePixelThatWasComputedForIt) {
  // Image twice the network's input; the cut resize is TensorFlow's legacy rule: score k belongs to input
  // pixel 4 k, which shows image pixels 8 k and 8 k + 1, centre 8 k + 1/2.
  Bound bound(miniature(3), map_of(5), 96, 64);
  ASSERT_EQ(bound.sut().step(random_image(96, 64, 1), bound.out), rt::Status::ok);
  MaterialDistribution sampled{};
  for (int y = 0; y < 8; ++y)
    for (int x = 0; x < 12; ++x) {
      bound.out.sample(8.0F * static_cast<float>(x) + 0.5F, 8.0F * static_cast<float>(y) + 0.5F, sampled);
      const auto bytes = bound.out.pixel(x, y);
      const float sum = static_cast<float>(std::accumulate(bytes.begin(), bytes.end(), 0));
      for (std::size_t m = 0; m < kMaterialCount; ++m)
        ASSERT_NEAR(sampled[m], static_cast<float>(bytes[m]) / sum, 1e-5F);
    }
}

TEST(MaterialScores, SampleBlendsHoldsTheBorderAndSumsToOne) {
  std::vector<std::uint8_t> bytes(2 * 1 * kMaterialCount, 0);
  bytes[3] = 255;
  bytes[kMaterialCount + 5] = 255;
  const MaterialScores sut{2, 1, bytes, {0.5F, 0}, {1, 0}};
  MaterialDistribution out{};
  sut.sample(0.5F, 0, out);  // a quarter of the way
  EXPECT_FLOAT_EQ(out[3], 0.75F);
  EXPECT_FLOAT_EQ(out[5], 0.25F);
  sut.sample(-100, 50, out);
  EXPECT_FLOAT_EQ(out[3], 1.0F);
  sut.sample(1000, -3, out);
  EXPECT_FLOAT_EQ(out[5], 1.0F);
}

TEST(MaterialScores, UnwrittenScoresSayNothing) {
  std::vector<std::uint8_t> bytes(kMaterialCount, 0);
  const MaterialScores sut{1, 1, bytes, {}, {}};
  MaterialDistribution out{};
  sut.sample(0, 0, out);
  for (const float p : out) EXPECT_FLOAT_EQ(p, 1.0F / kMaterialCount);
}

}  // namespace
}  // namespace tactus::segment::test
