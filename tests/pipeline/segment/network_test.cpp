#include "pipeline/segment/network.hpp"

#include <gtest/gtest.h>

#include "tests/pipeline/segment/bound_network.hpp"

namespace tactus::segment::test {
namespace {

using tflite::Activation;
using tflite::BuiltinOperator;
using tflite::Padding;

int same_length(int in, int stride) { return (in + stride - 1) / stride; }
int valid_length(int in, int window, int stride, int dilation) {
  return (in - ((window - 1) * dilation + 1)) / stride + 1;
}

// Random geometry, weights and scales; XNNPACK's 8-bit convolutions are exact sums and one float rounding, so
// that the result must be the reference's to the last bit, on whatever processor this runs.
TEST(Network, Int8ConvolutionsAgreeWithIntegerReferenceToTheLastBit) {
  for (std::uint32_t seed = 1; seed <= 60; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    RandomWeights w(seed);
    ModelBuilder b;
    const int h = w.uniform(5, 19), width = w.uniform(5, 19), middle = w.uniform(1, 40),
              outputs = w.uniform(1, 40);
    const int window = 1 + 2 * w.uniform(0, 2), stride = w.uniform(1, 2), dilation = w.uniform(1, 2);
    const bool depthwise = w.uniform(0, 1) == 1;
    Padding padding = w.uniform(0, 1) == 1 ? Padding::SAME : Padding::VALID;
    if ((window - 1) * dilation + 1 > std::min(h, width)) padding = Padding::SAME;
    const auto activation = static_cast<Activation>(w.uniform(0, 2) == 2 ? 3 : w.uniform(0, 1));
    const int image = b.int8({1, h, width, 3}, 0.02F, w.uniform(-128, 127));
    const int mid = b.int8({1, h, width, middle}, 0.03F, w.uniform(-128, 127));
    b.conv(image, w.filter_qc8(b, {middle, 1, 1, 3}, 0, 0.02F), w.bias_i32(b, middle, 3000), mid,
           Padding::SAME, 1);
    const int oh =
        padding == Padding::SAME ? same_length(h, stride) : valid_length(h, window, stride, dilation);
    const int ow =
        padding == Padding::SAME ? same_length(width, stride) : valid_length(width, window, stride, dilation);
    const int multiplier = w.uniform(1, 2);
    const int channels = depthwise ? middle * multiplier : outputs;
    const int out = b.int8({1, oh, ow, channels}, 0.05F, w.uniform(-60, 60));
    const int bias = w.uniform(0, 3) == 0 ? -1 : w.bias_i32(b, channels, 3000);
    if (depthwise)
      b.depthwise(mid, w.filter_qc8(b, {1, window, window, channels}, 3, 0.02F), bias, out, padding, stride,
                  dilation, activation);
    else
      b.conv(mid, w.filter_qc8(b, {channels, window, window, middle}, 0, 0.005F), bias, out, padding, stride,
             dilation, activation);
    BoundNetwork sut(b.finish({image}, {out}));
    EXPECT_EQ(sut.largest_difference(seed), 0);
  }
}

// On x86 XNNPACK rounds these as the signed ones; its NEON kernels use a fixed-point product (rndnu), which
// lands on the other side of a half now and then. Two convolutions deep, that is a step.
TEST(Network, Uint8ConvolutionsAgreeWithIntegerReference) {
#if defined(__x86_64__)
  constexpr double kStepsMax = 0;
#else
  constexpr double kStepsMax = 2;
#endif
  for (std::uint32_t seed = 1; seed <= 30; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    RandomWeights w(seed);
    ModelBuilder b;
    const int h = w.uniform(4, 15), width = w.uniform(4, 15), middle = w.uniform(1, 24),
              outputs = w.uniform(1, 24);
    const int image = b.uint8({1, h, width, 3}, 0.02F, w.uniform(0, 255));
    const int mid = b.uint8({1, h, width, middle}, 0.04F, w.uniform(60, 190));
    b.conv(image, w.filter_qu8(b, {middle, 1, 1, 3}, 0.01F, w.uniform(0, 255)), w.bias_i32(b, middle, 3000),
           mid, Padding::SAME, 1);
    const int deep =
        b.uint8({1, same_length(h, 2), same_length(width, 2), middle}, 0.05F, w.uniform(60, 190));
    b.depthwise(mid, w.filter_qu8(b, {1, 3, 3, middle}, 0.01F, w.uniform(100, 150)),
                w.bias_i32(b, middle, 3000), deep, Padding::SAME, 2, 1, Activation::RELU6);
    const int out = b.uint8({1, same_length(h, 2), same_length(width, 2), outputs}, 0.05F, w.uniform(0, 255));
    b.conv(deep, w.filter_qu8(b, {outputs, 3, 3, middle}, 0.004F, 128), w.bias_i32(b, outputs, 3000), out,
           Padding::SAME, 1);
    BoundNetwork sut(b.finish({image}, {out}));
    EXPECT_LE(sut.largest_difference(seed), kStepsMax);
  }
}

TEST(Network, FloatConvolutionsAgreeWithDoubleReference) {
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    RandomWeights w(seed);
    ModelBuilder b;
    const int h = w.uniform(5, 12), width = w.uniform(5, 12), middle = w.uniform(2, 24),
              outputs = w.uniform(1, 24);
    const int image = b.real({1, h, width, 3}), mid = b.real({1, h, width, middle}),
              deep = b.real({1, h, width, middle}), sum = b.real({1, h, width, middle}),
              out = b.real({1, same_length(h, 2), same_length(width, 2), outputs});
    b.conv(image, w.filter_f32(b, {middle, 1, 1, 3}, 1), -1, mid, Padding::SAME, 1);
    b.depthwise(mid, w.filter_f32(b, {1, 3, 3, middle}, 0.5F), -1, deep, Padding::SAME, 1, 2,
                Activation::RELU6);
    b.add(mid, deep, sum);
    b.conv(sum, w.filter_f32(b, {outputs, 3, 3, middle}, 0.2F), -1, out, Padding::SAME, 2);
    BoundNetwork sut(b.finish({image}, {out}));
    EXPECT_LT(sut.largest_difference(seed), 1e-5 * middle);
  }
}

/// One operator between two 1x1 convolutions' worth of int8 data.
struct Middle {
  ModelBuilder b;
  RandomWeights w;
  int image, in;
  explicit Middle(std::uint32_t seed, int h = 9, int width = 11, int channels = 13, float scale = 0.04F,
                  int zero = -5)
      : w(seed) {
    image = b.int8({1, h, width, 3}, 0.02F, 3);
    in = b.int8({1, h, width, channels}, scale, zero);
    b.conv(image, w.filter_qc8(b, {channels, 1, 1, 3}, 0, 0.015F), w.bias_i32(b, channels, 2000), in,
           Padding::SAME, 1);
  }
};

TEST(Network, AdditionIsWithinOneStepOfExactArithmetic) {
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Middle m(seed);
    const int other = m.b.int8({1, 9, 11, 13}, m.w.real(0.01F, 0.09F), m.w.uniform(-40, 40));
    m.b.conv(m.image, m.w.filter_qc8(m.b, {13, 1, 1, 3}, 0, 0.02F), -1, other, Padding::SAME, 1);
    const int out = m.b.int8({1, 9, 11, 13}, 0.07F, m.w.uniform(-40, 40));
    m.b.add(m.in, other, out, seed % 2 == 0 ? Activation::RELU : Activation::NONE);
    BoundNetwork sut(m.b.finish({m.image}, {out}));
    EXPECT_LE(sut.largest_difference(seed), 1);
  }
}

TEST(Network, MultiplicationByPooledGateIsWithinOneStepOfExactArithmetic) {
  for (std::uint32_t seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Middle m(seed);
    const int mean = m.b.int8({1, 1, 1, 13}, 0.04F, -5);
    m.b.op(BuiltinOperator::AVERAGE_POOL_2D, {m.in}, {mean}, tflite::BuiltinOptions::Pool2DOptions,
           tflite::CreatePool2DOptions(m.b.builder(), Padding::VALID, 1, 1, 11, 9));
    const int gate = m.b.int8({1, 1, 1, 13}, 1.0F / 256, -128);
    m.b.op(BuiltinOperator::LOGISTIC, {mean}, {gate});
    const int out = m.b.int8({1, 9, 11, 13}, 0.03F, -9);
    m.b.mul(m.in, gate, out);
    BoundNetwork sut(m.b.finish({m.image}, {out}));
    EXPECT_LE(sut.largest_difference(seed), 1);
  }
}

TEST(Network, MeanIsWithinOneStepOfExactArithmetic) {
  for (std::uint32_t seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Middle m(seed, 9, 11, 70);
    const int mean = m.b.int8({1, 70}, m.w.real(0.004F, 0.05F), m.w.uniform(-40, 40));
    m.b.op(BuiltinOperator::MEAN, {m.in, m.b.int32_constant({-2, 1})}, {mean});
    BoundNetwork sut(m.b.finish({m.image}, {mean}));
    EXPECT_LE(sut.largest_difference(seed), 1);
  }
}

TEST(Network, ResizeFollowsAllThreeConventionsWithinOneStep) {
  for (int convention = 0; convention < 3; ++convention)
    for (const auto& [h, w] : {std::pair{36, 44}, std::pair{18, 22}, std::pair{13, 29}}) {
      SCOPED_TRACE("convention " + std::to_string(convention) + ", " + std::to_string(h) + "x" +
                   std::to_string(w));
      Middle m(7);
      const int large = m.b.int8({1, h, w, 13}, 0.04F, -5);
      m.b.resize(m.in, large, h, w, convention == 1, convention == 2);
      const int out = m.b.int8({1, h, w, 13}, 0.04F, -5);  // something behind it, so that it is not cut
      m.b.op(BuiltinOperator::RELU6, {large}, {out});
      BoundNetwork sut(m.b.finish({m.image}, {out}));
      EXPECT_LE(sut.largest_difference(3), 1);
    }
}

TEST(Network, ByteTablesAreExact) {
  for (const BuiltinOperator code :
       {BuiltinOperator::LOGISTIC, BuiltinOperator::HARD_SWISH, BuiltinOperator::RELU, BuiltinOperator::RELU6,
        BuiltinOperator::QUANTIZE}) {
    SCOPED_TRACE(static_cast<int>(code));
    Middle m(5);
    const int table = code == BuiltinOperator::LOGISTIC ? m.b.int8({1, 9, 11, 13}, 1.0F / 256, -128)
                                                        : m.b.int8({1, 9, 11, 13}, 0.031F, 9);
    m.b.op(code, {m.in}, {table});
    const int out = m.b.int8({1, 9, 11, 2}, 0.05F, 0);
    m.b.conv(table, m.w.filter_qc8(m.b, {2, 1, 1, 13}, 0, 0.01F), -1, out, Padding::SAME, 1);
    BoundNetwork sut(m.b.finish({m.image}, {out}));
    EXPECT_EQ(sut.largest_difference(11), 0);
  }
}

TEST(Network, PoolsAndPaddingAreExact) {
  for (const Padding padding : {Padding::SAME, Padding::VALID})
    for (const BuiltinOperator code : {BuiltinOperator::AVERAGE_POOL_2D, BuiltinOperator::MAX_POOL_2D}) {
      SCOPED_TRACE(static_cast<int>(code));
      Middle m(5, 9, 11, 70);
      const int padded = m.b.int8({1, 12, 12, 70}, 0.04F, -5);
      m.b.op(BuiltinOperator::PAD, {m.in, m.b.int32_constant({0, 0, 1, 2, 0, 1, 0, 0}, {4, 2})}, {padded});
      const int length = padding == Padding::SAME ? 6 : 5;
      const int pooled = m.b.int8({1, length, length, 70}, 0.04F, -5);
      m.b.pool(code, padded, pooled, padding, 3, 2);
      BoundNetwork sut(m.b.finish({m.image}, {pooled}));
      EXPECT_EQ(sut.largest_difference(11), 0);
    }
}

TEST(Network, GlobalAveragePoolAndFullyConnectedAreExact) {
  Middle m(5);
  const int pooled = m.b.int8({1, 1, 1, 13}, 0.04F, -5);
  m.b.op(BuiltinOperator::AVERAGE_POOL_2D, {m.in}, {pooled}, tflite::BuiltinOptions::Pool2DOptions,
         tflite::CreatePool2DOptions(m.b.builder(), Padding::VALID, 1, 1, 11, 9));
  const int flat = m.b.int8({1, 13}, 0.04F, -5);
  m.b.op(BuiltinOperator::RESHAPE, {pooled}, {flat});
  const int out = m.b.int8({1, 7}, 0.02F, 2);
  m.b.op(BuiltinOperator::FULLY_CONNECTED,
         {flat, m.w.filter_qc8(m.b, {7, 13}, 0, 0.02F), m.w.bias_i32(m.b, 7, 900)}, {out},
         tflite::BuiltinOptions::FullyConnectedOptions, tflite::CreateFullyConnectedOptions(m.b.builder()));
  BoundNetwork sut(m.b.finish({m.image}, {out}));
  EXPECT_EQ(sut.largest_difference(2), 0);
}

TEST(Network, ConcatenationOfPartsInPlaceCopiedAndRequantisedIsExact) {
  Middle m(9);
  const int a = m.b.int8({1, 9, 11, 5}, 0.03F, 4), b = m.b.int8({1, 9, 11, 6}, 0.05F, -4),
            c = m.b.int8({1, 9, 11, 13}, 0.03F, 4);
  m.b.conv(m.in, m.w.filter_qc8(m.b, {5, 1, 1, 13}, 0, 0.01F), -1, a, Padding::SAME, 1);   // in place
  m.b.conv(m.in, m.w.filter_qc8(m.b, {6, 3, 3, 13}, 0, 0.004F), -1, b, Padding::SAME, 1);  // another scale
  m.b.add(m.in, m.in, c);                                                                  // dense: copied
  const int joined = m.b.int8({1, 9, 11, 24}, 0.03F, 4);
  m.b.concat({a, b, c}, joined);
  const int again = m.b.int8({1, 9, 11, 29}, 0.03F, 4);
  m.b.concat({joined, a}, again);  // nested, and a part used twice
  const int out = m.b.int8({1, 9, 11, 3}, 0.05F, 1);
  m.b.conv(again, m.w.filter_qc8(m.b, {3, 3, 3, 29}, 0, 0.003F), -1, out, Padding::SAME, 1);
  BoundNetwork sut(m.b.finish({m.image}, {out}));
  EXPECT_LE(sut.largest_difference(4), 1);  // the addition's step
}

TEST(Network, FloatOperatorsAgreeWithDoubleReference) {
  ModelBuilder b;
  RandomWeights w(3);
  const int image = b.real({1, 12, 16, 3}), x = b.real({1, 12, 16, 6}), s = b.real({1, 12, 16, 6}),
            p = b.real({1, 6, 8, 6}), q = b.real({1, 6, 8, 6}), mean = b.real({1, 1, 1, 6}),
            gate = b.real({1, 1, 1, 6}), gated = b.real({1, 6, 8, 6}), up = b.real({1, 6, 8, 6}),
            joined = b.real({1, 6, 8, 12}), r = b.real({1, 6, 8, 12}), out = b.real({1, 6, 8, 4});
  b.conv(image, w.filter_f32(b, {6, 3, 3, 3}, 1), -1, x, Padding::SAME, 1);
  b.op(BuiltinOperator::HARD_SWISH, {x}, {s});
  b.pool(BuiltinOperator::AVERAGE_POOL_2D, s, p, Padding::SAME, 3, 2);
  b.pool(BuiltinOperator::MAX_POOL_2D, s, q, Padding::SAME, 3, 2);
  b.op(BuiltinOperator::MEAN, {p, b.int32_constant({1, 2})}, {mean});
  b.op(BuiltinOperator::LOGISTIC, {mean}, {gate});
  b.mul(q, gate, gated);
  b.resize(gate, up, 6, 8, false, true);
  b.concat({gated, up}, joined);
  b.op(BuiltinOperator::RELU6, {joined}, {r});
  b.conv(r, w.filter_f32(b, {4, 1, 1, 12}, 1), -1, out, Padding::SAME, 1);
  BoundNetwork sut(b.finish({image}, {out}));
  EXPECT_LT(sut.largest_difference(6), 2e-5);
}

TEST(Network, MiniatureIsCutBeforeItsLastResizeAndKeepsItsGeometry) {
  BoundNetwork sut(miniature(1));
  EXPECT_EQ(sut.network().scores().shape, (Shape{{1, 8, 12, 5}}));
  EXPECT_EQ(sut.network().use().operators_cut_count, 2U);
  EXPECT_EQ(sut.network().score_rows(), (AxisMap{0.25F, 0}));
  EXPECT_EQ(sut.network().score_columns(), (AxisMap{0.25F, 0}));
}

TEST(Network, SameImageGivesSameScoresAgainAndAfterAnother) {
  BoundNetwork sut(miniature(2));
  sut.fill_input(1);
  ASSERT_EQ(sut.network().invoke(), rt::Status::ok);
  const std::vector<double> first = BoundNetwork::values(sut.network().scores());
  sut.fill_input(2);
  ASSERT_EQ(sut.network().invoke(), rt::Status::ok);
  EXPECT_NE(BoundNetwork::values(sut.network().scores()), first);
  sut.fill_input(1);
  ASSERT_EQ(sut.network().invoke(), rt::Status::ok);
  EXPECT_EQ(BoundNetwork::values(sut.network().scores()), first);
}

TEST(Network, TwoNetworksInOneProcessDoNotDisturbEachOther) {
  BoundNetwork one(miniature(2)), two(miniature(3, 7));
  EXPECT_LE(one.largest_difference(5), 1);
  EXPECT_LE(two.largest_difference(5), 1);
  EXPECT_LE(one.largest_difference(6), 1);
}

TEST(Network, TooLittleMemoryIsASentenceNotACrash) {
  const FileBytes bytes = miniature(1);
  const auto model = read_tflite(bytes, "mini.tflite");
  ASSERT_TRUE(model);
  const std::size_t needed = Network::bytes_needed(*model).value();
  std::size_t refused = 0;
  for (std::size_t bytes_planned = 64; bytes_planned < needed; bytes_planned += 64 * 37) {
    const Memory memory(bytes_planned);
    const auto sut = Network::bind(*model, memory.slice());
    ASSERT_FALSE(sut) << bytes_planned << " of " << needed;
    EXPECT_EQ(sut.error().code, rt::ExitCode::bad_usage);
    EXPECT_NE(sut.error().message.find("mini.tflite: "), std::string::npos) << sut.error().message;
    ++refused;
  }
  EXPECT_GT(refused, 10U);
  const Memory enough(needed);
  EXPECT_TRUE(Network::bind(*model, enough.slice()));
}

TEST(Network, BytesNeededIsTheSameEveryTime) {
  const FileBytes bytes = miniature(1);
  const auto model = read_tflite(bytes, "mini.tflite");
  EXPECT_EQ(Network::bytes_needed(*model).value(), Network::bytes_needed(*model).value());
}

TEST(Network, OperatorItCannotRunIsNamed) {
  Middle m(1);
  const int out = m.b.int8({1, 9, 11, 13}, 0.04F, 0);
  m.b.op(static_cast<BuiltinOperator>(97), {m.in}, {out});
  const int last = m.b.int8({1, 9, 11, 13}, 0.04F, 0);
  m.b.op(BuiltinOperator::RELU, {out}, {last});
  const FileBytes bytes = m.b.finish({m.image}, {last});
  const auto model = read_tflite(bytes, "odd.tflite");
  ASSERT_TRUE(model) << model.error().message;
  const auto sut = Network::bytes_needed(*model);
  ASSERT_FALSE(sut);
  EXPECT_EQ(sut.error().code, rt::ExitCode::bad_input);
  EXPECT_EQ(sut.error().message, "odd.tflite: operator 1 has builtin code 97, which this program cannot run");
}

TEST(Network, ScalesBeyondXnnpackAreASentence) {
  Middle m(1);
  const int out = m.b.int8({1, 9, 11, 13}, 1e-9F, 0);
  m.b.conv(m.in, m.w.filter_qc8(m.b, {13, 1, 1, 13}, 0, 0.05F), -1, out, Padding::SAME, 1);
  const FileBytes bytes = m.b.finish({m.image}, {out});
  const auto model = read_tflite(bytes, "odd.tflite");
  ASSERT_TRUE(model);
  const auto sut = Network::bytes_needed(*model);
  ASSERT_FALSE(sut);
  EXPECT_NE(sut.error().message.find("operator 1 (CONV_2D): XNNPACK refuses it"), std::string::npos)
      << sut.error().message;
}

}  // namespace
}  // namespace tactus::segment::test
