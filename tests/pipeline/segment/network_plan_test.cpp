#include "pipeline/segment/network_plan.hpp"

#include <gtest/gtest.h>

#include "tests/pipeline/segment/bound_network.hpp"

namespace tactus::segment::test {
namespace {

using tflite::Padding;

TEST(NetworkPlan, BlocksThatLiveTogetherNeverOverlap) {
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    // A random chain with additions to random earlier results, so that lifetimes cross.
    RandomWeights w(seed);
    ModelBuilder b;
    const int image = b.int8({1, 8, 8, 3}, 0.1F, 0);
    std::vector<std::pair<int, int>> made;  // tensor, channels
    int last = image, channels = 3;
    for (int i = 0; i < 12; ++i) {
      const int next_channels = w.uniform(1, 40);
      const int next = b.int8({1, 8, 8, next_channels}, 0.1F, 0);
      b.conv(last, w.filter_qc8(b, {next_channels, 1, 1, channels}, 0, 0.01F), -1, next, Padding::SAME, 1);
      last = next;
      channels = next_channels;
      for (const auto& [tensor, count] : made)
        if (count == channels) {
          const int sum = b.int8({1, 8, 8, channels}, 0.1F, 0);
          b.add(last, tensor, sum);
          last = sum;
          break;
        }
      made.emplace_back(last, channels);
    }
    const FileBytes bytes = b.finish({image}, {last});
    const auto model = read_tflite(bytes, "chain.tflite");
    ASSERT_TRUE(model) << model.error().message;
    const auto sut = plan_network(*model);
    ASSERT_TRUE(sut);
    std::size_t sum_bytes = 0;
    for (std::size_t i = 0; i < sut->blocks.size(); ++i) {
      const Block& a = sut->blocks[i];
      sum_bytes += a.bytes;
      EXPECT_LE(a.offset_bytes + a.bytes, sut->tensor_bytes);
      EXPECT_EQ(a.offset_bytes % rt::kCacheLineBytes, 0U);
      for (std::size_t j = 0; j < i; ++j) {
        const Block& c = sut->blocks[j];
        const bool together = a.first_use <= c.last_use && c.first_use <= a.last_use;
        const bool overlap =
            a.offset_bytes < c.offset_bytes + c.bytes && c.offset_bytes < a.offset_bytes + a.bytes;
        EXPECT_FALSE(together && overlap) << "blocks " << j << " and " << i;
      }
    }
    EXPECT_LT(sut->tensor_bytes, sum_bytes) << "nothing is shared";
  }
}

TEST(NetworkPlan, JoinedPartsLieSideBySideInOneBlock) {
  const FileBytes bytes = miniature(1);
  const auto model = read_tflite(bytes, "mini.tflite");
  const auto sut = plan_network(*model);
  ASSERT_TRUE(sut);
  const auto concat = std::find_if(model->operators.begin(), model->operators.end(),
                                   [](const Operator& op) { return op.kind == OperatorKind::concatenation; });
  const Placement& joined = sut->placements[static_cast<std::size_t>(concat->outputs[0])];
  const Placement& first = sut->placements[static_cast<std::size_t>(concat->inputs[0])];
  const Placement& second = sut->placements[static_cast<std::size_t>(concat->inputs[1])];
  EXPECT_EQ(first.block, joined.block);
  EXPECT_EQ(second.block, joined.block);
  EXPECT_EQ(second.offset_bytes - first.offset_bytes, 6U);
  EXPECT_EQ(first.pixel_stride, 16U);
}

TEST(NetworkPlan, ScoreMapFollowsTheConventionOfTheCutResize) {
  const auto plan_of = [](bool align_corners, bool half_pixel, bool resize) {
    ModelBuilder b;
    RandomWeights w(1);
    const int image = b.int8({1, 33, 65, 3}, 0.1F, 0), scores = b.int8({1, 17, 33, 4}, 0.1F, 0),
              large = b.int8({1, 33, 65, 4}, 0.1F, 0);
    b.conv(image, w.filter_qc8(b, {4, 3, 3, 3}, 0, 0.01F), -1, scores, Padding::SAME, 2);
    if (resize) b.resize(scores, large, 33, 65, align_corners, half_pixel);
    const FileBytes bytes = b.finish({image}, {resize ? large : scores});
    const auto model = read_tflite(bytes, "net.tflite");
    return plan_network(model.value()).value();
  };
  EXPECT_EQ(plan_of(true, false, true).score_rows, (AxisMap{16.0F / 32, 0}));
  EXPECT_EQ(plan_of(false, false, true).score_columns, (AxisMap{33.0F / 65, 0}));
  const float ratio = 33.0F / 65;
  EXPECT_EQ(plan_of(false, true, true).score_columns, (AxisMap{ratio, 0.5F * ratio - 0.5F}));
  EXPECT_EQ(plan_of(false, false, false).score_columns, (AxisMap{ratio, 0.5F * ratio - 0.5F}));
}

TEST(NetworkPlan, ModelsThatAreNoImageToScoresNetworkAreRefused) {
  ModelBuilder b;
  RandomWeights w(1);
  const int image = b.int8({1, 8, 8, 4}, 0.1F, 0), out = b.int8({1, 8, 8, 4}, 0.1F, 0);
  b.conv(image, w.filter_qc8(b, {4, 3, 3, 4}, 0, 0.01F), -1, out, Padding::SAME, 1);
  const FileBytes bytes = b.finish({image}, {out});
  const auto model = read_tflite(bytes, "four.tflite");
  const auto sut = plan_network(*model);
  ASSERT_FALSE(sut);
  EXPECT_NE(sut.error().message.find("is not one image of 3 channels"), std::string::npos);
}

}  // namespace
}  // namespace tactus::segment::test
