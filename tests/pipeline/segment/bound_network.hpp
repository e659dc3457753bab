// A network from a file's bytes, bound in memory of its own, beside the reference interpreter of the same
// model.
#pragma once

#include <gtest/gtest.h>

#include <cstring>
#include <memory>
#include <random>

#include "pipeline/segment/network.hpp"
#include "tests/pipeline/segment/model_builder.hpp"
#include "tests/pipeline/segment/reference_interpreter.hpp"

namespace tactus::segment::test {

class BoundNetwork {
 public:
  explicit BoundNetwork(FileBytes bytes) : bytes_(std::move(bytes)) {
    auto read = read_tflite(bytes_, "test.tflite");
    if (!read) throw std::runtime_error(read.error().message);
    model_ = std::make_unique<Model>(std::move(*read));
    auto needed = Network::bytes_needed(*model_);
    if (!needed) throw std::runtime_error(needed.error().message);
    memory_ = std::make_unique<Memory>(*needed);
    auto network = Network::bind(*model_, memory_->slice());
    if (!network) throw std::runtime_error(network.error().message);
    network_ = std::make_unique<Network>(std::move(*network));
  }

  [[nodiscard]] const Model& model() const { return *model_; }
  Network& network() { return *network_; }

  /// Elements of a view as doubles.
  static std::vector<double> values(const TensorView& view) {
    std::vector<double> out;
    for (std::size_t i = 0; i < view.shape.elements_count(); ++i) {
      const std::byte* p = view.bytes.data() + i * bytes_per_element(view.type);
      if (view.type == ElementType::float32) {
        float v = 0;
        std::memcpy(&v, p, 4);
        out.push_back(static_cast<double>(v));
      } else if (view.type == ElementType::int8) {
        out.push_back(static_cast<double>(static_cast<std::int8_t>(*p)));
      } else {
        out.push_back(static_cast<double>(static_cast<std::uint8_t>(*p)));
      }
    }
    return out;
  }

  /// Fills the input at random; returns the values, which invoke() may overwrite.
  std::vector<double> fill_input(std::uint32_t seed) {
    std::mt19937 random(seed);
    const TensorView& in = network_->input();
    for (std::size_t i = 0; i < in.shape.elements_count(); ++i) {
      if (in.type == ElementType::float32) {
        const float v = std::uniform_real_distribution<float>(-1, 1)(random);
        std::memcpy(in.bytes.data() + i * 4, &v, 4);
      } else {
        in.bytes[i] = static_cast<std::byte>(random() & 0xff);
      }
    }
    return values(in);
  }

  /// Largest difference between the network's scores and the reference's, on a random image.
  double largest_difference(std::uint32_t seed, Rounding rounding = Rounding::xnnpack) {
    ReferenceInterpreter reference(*model_, rounding);
    reference.tensor(model_->inputs[0]) = fill_input(seed);
    const auto plan = plan_network(*model_);
    for (const std::int32_t i : plan.value().operators)
      reference.run_operator(model_->operators[static_cast<std::size_t>(i)]);
    EXPECT_EQ(network_->invoke(), rt::Status::ok);
    const std::vector<double> expected = reference.tensor(plan.value().scores);
    const std::vector<double> actual = values(network_->scores());
    EXPECT_EQ(expected.size(), actual.size());
    double largest = 0;
    std::size_t saturated = 0;
    for (std::size_t i = 0; i < std::min(expected.size(), actual.size()); ++i) {
      largest = std::max(largest, std::abs(expected[i] - actual[i]));
      saturated += expected[i] == expected[0];
    }
    // A result that is the same everywhere would agree by accident.
    EXPECT_LT(saturated, expected.size()) << "the reference result is constant";
    return largest;
  }

 private:
  FileBytes bytes_;
  std::unique_ptr<Model> model_;
  std::unique_ptr<Memory> memory_;
  std::unique_ptr<Network> network_;
};

/// A miniature of the networks that run for real, int8: strided convolution, two bottlenecks (depthwise, one
/// dilated, one with an addition), image pooling resized and joined, a head, and a final resize and argmax
/// that are cut. Input uint8 1 x 32 x 48 x 3, scores int8 1 x 8 x 12 x `classes`.
inline FileBytes miniature(std::uint32_t seed, int classes = 5) {
  using tflite::Activation;
  using tflite::BuiltinOperator;
  using tflite::Padding;
  ModelBuilder b;
  RandomWeights w(seed);
  // Drawn one after the other: the order in which arguments are evaluated differs between processors.
  struct Weights {
    int filter, bias;
  };
  const auto weights = [&](const std::vector<std::int32_t>& shape, int dimension, float scale, int reach) {
    return Weights{w.filter_qc8(b, shape, dimension, scale),
                   w.bias_i32(b, shape[static_cast<std::size_t>(dimension)], reach)};
  };
  const auto conv = [&](int in, Weights f, int out, Padding padding, int stride, int dilation = 1,
                        Activation activation = Activation::NONE) {
    b.conv(in, f.filter, f.bias, out, padding, stride, dilation, activation);
  };
  const auto depthwise = [&](int in, Weights f, int out, Padding padding, int stride, int dilation,
                             Activation activation) {
    b.depthwise(in, f.filter, f.bias, out, padding, stride, dilation, activation);
  };
  const float relu6 = 6.0F / 255;
  const int image = b.uint8({1, 32, 48, 3}, 1 / 127.5F, 127);
  const int x0 = b.int8({1, 32, 48, 3}, 1 / 127.5F, -1);
  b.op(BuiltinOperator::QUANTIZE, {image}, {x0});
  const int x1 = b.int8({1, 16, 24, 8}, relu6, -128);
  conv(x0, weights({8, 3, 3, 3}, 0, 0.008F, 4000), x1, Padding::SAME, 2, 1, Activation::RELU6);
  const int x2 = b.int8({1, 16, 24, 8}, relu6, -128);
  depthwise(x1, weights({1, 3, 3, 8}, 3, 0.006F, 9000), x2, Padding::SAME, 1, 1, Activation::RELU6);
  const int x3 = b.int8({1, 16, 24, 8}, 0.04F, 5);
  conv(x2, weights({8, 1, 1, 8}, 0, 0.006F, 5000), x3, Padding::SAME, 1);
  const int x4 = b.int8({1, 16, 24, 8}, 0.05F, -7);
  b.add(x3, x1, x4);
  const int x5 = b.int8({1, 8, 12, 8}, relu6, -128);
  depthwise(x4, weights({1, 3, 3, 8}, 3, 0.008F, 4000), x5, Padding::SAME, 2, 1, Activation::RELU6);
  const int x6 = b.int8({1, 8, 12, 8}, relu6, -128);
  depthwise(x5, weights({1, 3, 3, 8}, 3, 0.008F, 9000), x6, Padding::SAME, 1, 2, Activation::RELU6);
  const int pooled = b.int8({1, 1, 1, 8}, relu6, -128);
  b.op(BuiltinOperator::MEAN, {x6, b.int32_constant({1, 2})}, {pooled},
       tflite::BuiltinOptions::ReducerOptions, tflite::CreateReducerOptions(b.builder(), true));
  const int p1 = b.int8({1, 1, 1, 6}, 0.03F, -128);
  conv(pooled, weights({6, 1, 1, 8}, 0, 0.01F, 9000), p1, Padding::SAME, 1, 1, Activation::RELU);
  const int p2 = b.int8({1, 8, 12, 6}, 0.03F, -128);
  b.resize(p1, p2, 8, 12, false, false);
  const int a1 = b.int8({1, 8, 12, 10}, 0.03F, -128);
  conv(x6, weights({10, 1, 1, 8}, 0, 0.01F, 4000), a1, Padding::SAME, 1, 1, Activation::RELU);
  const int joined = b.int8({1, 8, 12, 16}, 0.03F, -128);
  b.concat({p2, a1}, joined);
  const int scores = b.int8({1, 8, 12, classes}, 0.05F, 3);
  conv(joined, weights({classes, 1, 1, 16}, 0, 0.01F, 3000), scores, Padding::SAME, 1);
  const int large = b.int8({1, 32, 48, classes}, 0.05F, 3);
  b.resize(scores, large, 32, 48, false, false);
  const int labels = b.tensor({1, 32, 48}, tflite::TensorType::INT32);
  b.op(BuiltinOperator::ARG_MAX, {large, b.int32_constant({3})}, {labels});
  return b.finish({image}, {labels});
}

}  // namespace tactus::segment::test
