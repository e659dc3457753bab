#include "pipeline/segment/tflite_model.hpp"

#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <functional>
#include <random>

#include "tests/pipeline/segment/bound_network.hpp"

namespace tactus::segment::test {
namespace {

using tflite::Activation;
using tflite::BuiltinOperator;
using tflite::Padding;

std::string error_of(const FileBytes& bytes) {
  const auto model = read_tflite(bytes, "bad.tflite");
  if (model) return "(was read)";
  EXPECT_EQ(model.error().code, rt::ExitCode::bad_input);
  return model.error().message;
}

/// image -> conv 3x3 stride 2 -> out, with one thing wrong.
struct Spoil {
  ModelBuilder b;
  RandomWeights w{1};
  std::vector<std::int32_t> filter_shape = {4, 3, 3, 3}, out_shape = {1, 4, 4, 4};
  int bias_count = 4, stride = 2, dilation = 1;
  Quant image_quant = {{0.1F}, {0}, 0};
  std::vector<std::int32_t> image_shape = {1, 8, 8, 3};
  Activation activation = Activation::NONE;
  std::uint32_t version = 3;
  int image_index = 0, out_index = -1;

  FileBytes file() {
    const int image = b.tensor(image_shape, tflite::TensorType::INT8, image_quant);
    const int filter = w.filter_qc8(b, filter_shape, 0, 0.01F);
    const int bias = w.bias_i32(b, bias_count, 100);
    const int out = b.int8(out_shape, 0.1F, 0);
    b.conv(image_index, filter, bias, out_index < 0 ? out : out_index, Padding::SAME, stride, dilation,
           activation);
    return b.finish({image}, {out}, version);
  }
};

TEST(TfliteModel, ReadsShapesQuantisationConstantsAndOptions) {
  const FileBytes bytes = miniature(4);
  const auto sut = read_tflite(bytes, "mini.tflite");
  ASSERT_TRUE(sut) << sut.error().message;
  ASSERT_EQ(sut->operators.size(), 15U);
  const Operator& first = sut->operators[1];
  EXPECT_EQ(first.kind, OperatorKind::conv);
  EXPECT_EQ(first.stride_h, 2);
  EXPECT_EQ(first.window_w, 3);
  EXPECT_EQ(first.activation, segment::Activation::relu6);
  const Tensor& filter = sut->tensors[static_cast<std::size_t>(first.inputs[1])];
  EXPECT_EQ(filter.shape, (Shape{{8, 3, 3, 3}}));
  EXPECT_EQ(filter.constant.size(), 216U);
  EXPECT_EQ(filter.quantization.scales.size(), 8U);
  EXPECT_EQ(filter.quantization.dimension, 0);
  EXPECT_EQ(sut->operators[6].kind, OperatorKind::depthwise_conv);
  EXPECT_EQ(sut->operators[6].dilation_w, 2);
  const Tensor& image = sut->tensors[static_cast<std::size_t>(sut->inputs[0])];
  EXPECT_EQ(image.type, ElementType::uint8);
  EXPECT_EQ(image.zero_point(), 127);
  EXPECT_FLOAT_EQ(image.scale(), 1 / 127.5F);
}

TEST(TfliteModel, SpoiltFilesGetASentenceThatNamesTheSpot) {
  struct Case {
    std::function<void(Spoil&)> spoil;
    const char* expected;
  };
  const std::vector<Case> cases = {
      {[](Spoil&) {}, "(was read)"},
      {[](Spoil& s) { s.version = 2; }, "schema version is 2"},
      {[](Spoil& s) {
         s.filter_shape = {4, 3, 3, 5};
       },
       "operator 0 (CONV_2D): its filter reads 5 channels"},
      {[](Spoil& s) { s.bias_count = 3; }, "its bias has 3 values for 4 output channels"},
      {[](Spoil& s) {
         s.out_shape = {1, 4, 5, 4};
       },
       "has shape [1,4,5,4], expected [1,4,4,4]"},
      {[](Spoil& s) { s.stride = 0; }, "stride, dilation or window is 0"},
      {[](Spoil& s) { s.dilation = -1; }, "stride, dilation or window is -1"},
      {[](Spoil& s) { s.activation = Activation::TANH; }, "fused activation 4"},
      {[](Spoil& s) { s.image_index = 77; }, "tensor index 77 is outside 0..3"},
      {[](Spoil& s) { s.image_index = -1; }, "its first input is missing"},
      {[](Spoil& s) { s.image_index = 3; }, "reads tensor 3 before anything computes it"},
      {[](Spoil& s) { s.out_index = 0; }, "writes tensor 0, which is constant, an input or already computed"},
      {[](Spoil& s) { s.out_index = 2; }, "writes tensor 2, which is constant"},
      {[](Spoil& s) { s.image_quant.scales = {0.0F}; }, "tensor 0 't0': scale 0 is not a positive number"},
      {[](Spoil& s) { s.image_quant.scales = {-1.0F}; }, "scale 0 is not a positive number"},
      {[](Spoil& s) { s.image_quant.scales = {std::numeric_limits<float>::quiet_NaN()}; },
       "scale 0 is not a positive"},
      {[](Spoil& s) { s.image_quant.zeros = {128}; }, "zero point 128 does not fit its type"},
      {[](Spoil& s) {
         s.image_quant = {{1, 1}, {0, 0}, 3};
       },
       "2 scales for 3 slices"},
      {[](Spoil& s) {
         s.image_quant = {{1, 1}, {0, 0}, 4};
       },
       "quantised dimension 4 is outside its shape"},
      {[](Spoil& s) {
         s.image_quant.zeros = {0, 0};
       },
       "1 scales but 2 zero points"},
      {[](Spoil& s) {
         s.image_shape = {1, -8, 8, 3};
       },
       "dimension 1 is -8"},
      {[](Spoil& s) {
         s.image_shape = {1, 30000, 30000, 3};
       },
       "has more than 2^27 elements"},
  };
  for (const Case& c : cases) {
    Spoil spoil;
    c.spoil(spoil);
    const std::string message = error_of(spoil.file());
    EXPECT_NE(message.find(c.expected), std::string::npos) << message << "\n  expected: " << c.expected;
    if (std::string(c.expected) != "(was read)") {
      EXPECT_EQ(message.rfind("bad.tflite: ", 0), 0U) << message;
    }
  }
}

TEST(TfliteModel, ConstantOfWrongLengthIsNamed) {
  ModelBuilder b;
  const int image = b.int8({1, 4, 4, 3}, 0.1F, 0);
  const int filter =
      b.tensor({2, 1, 1, 3}, tflite::TensorType::INT8, {{0.1F}, {0}, 0}, std::vector<std::uint8_t>(7, 1));
  const int out = b.int8({1, 4, 4, 2}, 0.1F, 0);
  b.conv(image, filter, -1, out, Padding::SAME, 1);
  EXPECT_NE(error_of(b.finish({image}, {out}))
                .find("tensor 1 't1': its buffer holds 7 bytes, its shape [2,1,1,3] needs 6"),
            std::string::npos);
}

TEST(TfliteModel, OtherFilesAreRefused) {
  EXPECT_NE(error_of(FileBytes()).find("is not a .tflite file"), std::string::npos);
  EXPECT_NE(error_of(FileBytes(1000, std::byte{0x41})).find("is not a .tflite file"), std::string::npos);
}

TEST(TfliteModel, EveryCutOfAFileIsRefusedOrHarmless) {
  const FileBytes whole = miniature(4);
  std::size_t refused = 0;
  for (std::size_t length = 0; length < whole.size(); length += length < 400 ? 1 : 13) {
    const FileBytes part = aligned_copy(reinterpret_cast<const std::uint8_t*>(whole.data()), length);
    refused += read_tflite(part, "cut.tflite").has_value() ? 0U : 1U;
  }
  EXPECT_GT(refused, 300U);
}

/// What a reader must guarantee so that the builder may trust it.
void expect_invariants(const Model& model) {
  for (const Tensor& t : model.tensors) {
    ASSERT_LE(t.shape.elements_count(), kElementsCountMax);
    if (t.is_constant() && t.type != ElementType::other) {
      ASSERT_EQ(t.constant.size(), t.shape.elements_count() * bytes_per_element(t.type));
    }
    for (const float scale : t.quantization.scales) ASSERT_GT(scale, 0.0F);
  }
  for (const Operator& op : model.operators) {
    for (const std::int32_t i : op.inputs)
      ASSERT_TRUE(i >= -1 && i < static_cast<std::int32_t>(model.tensors.size()));
    for (const std::int32_t i : op.outputs)
      ASSERT_TRUE(i >= 0 && i < static_cast<std::int32_t>(model.tensors.size()));
  }
}

// Random damage to a good file: the reader refuses it or delivers a model that the plan and the builder
// survive.
TEST(TfliteModel, DamagedFilesNeverCrashReaderPlanOrNetwork) {
  const FileBytes whole = miniature(4);
  std::size_t read = 0, built = 0;
  for (std::uint32_t seed = 1; seed <= 3000; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    FileBytes bytes = whole;
    for (std::uint32_t i = 0; i <= seed % 4; ++i)
      bytes[random() % bytes.size()] ^= static_cast<std::byte>(1U << random() % 8);
    const auto model = read_tflite(bytes, "damaged.tflite");
    if (!model) continue;
    ++read;
    expect_invariants(*model);
    const auto plan = plan_network(*model);
    if (!plan || plan->tensor_bytes > (64U << 20)) continue;
    built += Network::bytes_needed(*model).has_value() ? 1U : 0U;
  }
  EXPECT_GT(read, 300U) << "the damage is too heavy to test what comes after the reader";
  EXPECT_LT(read, 3000U);
  EXPECT_GT(built, 200U);
}

TEST(TfliteModel, LoadNamesAFileThatIsNotThere) {
  const auto sut = load_model("/nonexistent/net.tflite");
  ASSERT_FALSE(sut);
  EXPECT_EQ(sut.error().code, rt::ExitCode::bad_input);
  EXPECT_NE(sut.error().message.find("/nonexistent/net.tflite: cannot be opened"), std::string::npos);
}

TEST(TfliteModel, LoadKeepsTheBytesThatTheModelLooksInto) {
  const FileBytes bytes = miniature(4);
  const std::string path = testing::TempDir() + "mini.tflite";
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  auto loaded = load_model(path);
  ASSERT_TRUE(loaded) << loaded.error().message;
  const LoadedModel sut = std::move(*loaded);
  const std::byte* first = sut.storage.data();
  const Tensor& filter = sut.model.tensors[static_cast<std::size_t>(sut.model.operators[1].inputs[1])];
  EXPECT_GE(filter.constant.data(), first);
  EXPECT_LE(filter.constant.data() + filter.constant.size(), first + sut.storage.size());
  std::remove(path.c_str());
}

TEST(TfliteModel, SamePaddingPutsTheOddRowAtTheEnd) {
  Operator op;
  op.window_h = op.window_w = 3;
  op.stride_h = op.stride_w = 2;
  const Margins sut = margins_of(op, Shape{{1, 8, 7, 1}}, Shape{{1, 4, 4, 1}});
  EXPECT_EQ(sut.top, 0);
  EXPECT_EQ(sut.bottom, 1);
  EXPECT_EQ(sut.left, 1);
  EXPECT_EQ(sut.right, 1);
}

}  // namespace
}  // namespace tactus::segment::test
