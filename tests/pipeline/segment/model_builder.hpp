// Writes small .tflite files in memory, with the same schema that the reader reads.
#pragma once

#include <tflite_subset_generated.h>

#include <cstdint>
#include <cstring>
#include <random>
#include <string>
#include <vector>

#include "pipeline/segment/tflite_model.hpp"
#include "rt/slice.hpp"

namespace tactus::segment::test {

struct Quant {
  std::vector<float> scales;
  std::vector<std::int64_t> zeros;
  int dimension = 0;
};

/// A file's bytes at an alignment that read_tflite accepts.
using FileBytes = std::vector<std::byte>;

inline FileBytes aligned_copy(const std::uint8_t* data, std::size_t bytes) {
  FileBytes out(bytes);  // operator new aligns to 16
  if (bytes > 0) std::memcpy(out.data(), data, bytes);
  return out;
}

class ModelBuilder {
 public:
  ModelBuilder() { buffers_.push_back(tflite::CreateBuffer(fbb_)); }

  int tensor(const std::vector<std::int32_t>& shape, tflite::TensorType type, const Quant& quant = {},
             const std::vector<std::uint8_t>& data = {}) {
    std::uint32_t buffer = 0;
    if (!data.empty()) {
      buffer = static_cast<std::uint32_t>(buffers_.size());
      fbb_.ForceVectorAlignment(data.size(), 1, 16);
      const auto bytes = fbb_.CreateVector(data);
      buffers_.push_back(tflite::CreateBuffer(fbb_, bytes));
    }
    flatbuffers::Offset<tflite::QuantizationParameters> q;
    if (!quant.scales.empty())
      q = tflite::CreateQuantizationParametersDirect(fbb_, nullptr, nullptr, &quant.scales, &quant.zeros, 0,
                                                     0, quant.dimension);
    const std::string name = "t" + std::to_string(tensors_.size());
    tensors_.push_back(tflite::CreateTensorDirect(fbb_, &shape, type, buffer, name.c_str(), q));
    return static_cast<int>(tensors_.size()) - 1;
  }

  template <typename T>
  static std::vector<std::uint8_t> bytes_of(const std::vector<T>& values) {
    std::vector<std::uint8_t> out(values.size() * sizeof(T));
    std::memcpy(out.data(), values.data(), out.size());
    return out;
  }

  int int8(const std::vector<std::int32_t>& shape, float scale, std::int64_t zero) {
    return tensor(shape, tflite::TensorType::INT8, {{scale}, {zero}, 0});
  }
  int uint8(const std::vector<std::int32_t>& shape, float scale, std::int64_t zero) {
    return tensor(shape, tflite::TensorType::UINT8, {{scale}, {zero}, 0});
  }
  int real(const std::vector<std::int32_t>& shape) { return tensor(shape, tflite::TensorType::FLOAT32); }
  int int32_constant(const std::vector<std::int32_t>& values, std::vector<std::int32_t> shape = {}) {
    if (shape.empty()) shape = {static_cast<std::int32_t>(values.size())};
    return tensor(shape, tflite::TensorType::INT32, {}, bytes_of(values));
  }

  template <typename Options>
  void op(tflite::BuiltinOperator code, const std::vector<std::int32_t>& inputs,
          const std::vector<std::int32_t>& outputs, tflite::BuiltinOptions type,
          flatbuffers::Offset<Options> options) {
    const auto index = static_cast<std::uint32_t>(codes_.size());
    const auto old = static_cast<std::int8_t>(static_cast<int>(code) > 127 ? 127 : static_cast<int>(code));
    codes_.push_back(tflite::CreateOperatorCode(fbb_, old, 0, 1, code));
    operators_.push_back(tflite::CreateOperatorDirect(fbb_, index, &inputs, &outputs, type, options.Union()));
  }
  void op(tflite::BuiltinOperator code, const std::vector<std::int32_t>& inputs,
          const std::vector<std::int32_t>& outputs) {
    op(code, inputs, outputs, tflite::BuiltinOptions::NONE, flatbuffers::Offset<void>());
  }

  void conv(int in, int filter, int bias, int out, tflite::Padding padding, int stride, int dilation = 1,
            tflite::Activation activation = tflite::Activation::NONE) {
    op(tflite::BuiltinOperator::CONV_2D, {in, filter, bias}, {out}, tflite::BuiltinOptions::Conv2DOptions,
       tflite::CreateConv2DOptions(fbb_, padding, stride, stride, activation, dilation, dilation));
  }
  void depthwise(int in, int filter, int bias, int out, tflite::Padding padding, int stride, int dilation = 1,
                 tflite::Activation activation = tflite::Activation::NONE) {
    op(tflite::BuiltinOperator::DEPTHWISE_CONV_2D, {in, filter, bias}, {out},
       tflite::BuiltinOptions::DepthwiseConv2DOptions,
       tflite::CreateDepthwiseConv2DOptions(fbb_, padding, stride, stride, 1, activation, dilation,
                                            dilation));
  }
  void pool(tflite::BuiltinOperator code, int in, int out, tflite::Padding padding, int window, int stride) {
    op(code, {in}, {out}, tflite::BuiltinOptions::Pool2DOptions,
       tflite::CreatePool2DOptions(fbb_, padding, stride, stride, window, window));
  }
  void add(int a, int b, int out, tflite::Activation activation = tflite::Activation::NONE) {
    op(tflite::BuiltinOperator::ADD, {a, b}, {out}, tflite::BuiltinOptions::AddOptions,
       tflite::CreateAddOptions(fbb_, activation));
  }
  void mul(int a, int b, int out) {
    op(tflite::BuiltinOperator::MUL, {a, b}, {out}, tflite::BuiltinOptions::MulOptions,
       tflite::CreateMulOptions(fbb_));
  }
  void concat(const std::vector<std::int32_t>& parts, int out) {
    op(tflite::BuiltinOperator::CONCATENATION, parts, {out}, tflite::BuiltinOptions::ConcatenationOptions,
       tflite::CreateConcatenationOptions(fbb_, 3));
  }
  void resize(int in, int out, int height, int width, bool align_corners, bool half_pixel) {
    const int size = int32_constant({height, width});
    op(tflite::BuiltinOperator::RESIZE_BILINEAR, {in, size}, {out},
       tflite::BuiltinOptions::ResizeBilinearOptions,
       tflite::CreateResizeBilinearOptions(fbb_, 0, 0, align_corners, half_pixel));
  }

  FileBytes finish(const std::vector<std::int32_t>& inputs, const std::vector<std::int32_t>& outputs,
                   std::uint32_t version = 3) {
    const std::vector graphs = {
        tflite::CreateSubGraphDirect(fbb_, &tensors_, &inputs, &outputs, &operators_)};
    const auto model = tflite::CreateModelDirect(fbb_, version, &codes_, &graphs, "test", &buffers_);
    tflite::FinishModelBuffer(fbb_, model);
    return aligned_copy(fbb_.GetBufferPointer(), fbb_.GetSize());
  }

  flatbuffers::FlatBufferBuilder& builder() { return fbb_; }

 private:
  flatbuffers::FlatBufferBuilder fbb_;
  std::vector<flatbuffers::Offset<tflite::Buffer>> buffers_;
  std::vector<flatbuffers::Offset<tflite::Tensor>> tensors_;
  std::vector<flatbuffers::Offset<tflite::OperatorCode>> codes_;
  std::vector<flatbuffers::Offset<tflite::Operator>> operators_;
};

/// Weights, biases and scales of a convolution, at random but such that sums land inside the 8-bit range.
class RandomWeights {
 public:
  explicit RandomWeights(std::uint32_t seed) : random_(seed) {}

  int uniform(int low, int high) { return std::uniform_int_distribution<int>(low, high)(random_); }
  float real(float low, float high) { return std::uniform_real_distribution<float>(low, high)(random_); }

  /// int8, one scale per slice of `dimension` (the output channels).
  int filter_qc8(ModelBuilder& builder, const std::vector<std::int32_t>& shape, int dimension,
                 float typical_scale) {
    std::size_t count = 1;
    for (const std::int32_t d : shape) count *= static_cast<std::size_t>(d);
    std::vector<std::int8_t> values(count);
    for (std::int8_t& v : values) v = static_cast<std::int8_t>(uniform(-127, 127));
    Quant quant;
    quant.dimension = dimension;
    for (std::int32_t i = 0; i < shape[static_cast<std::size_t>(dimension)]; ++i) {
      quant.scales.push_back(typical_scale * real(0.5F, 1.5F));
      quant.zeros.push_back(0);
    }
    return builder.tensor(shape, tflite::TensorType::INT8, quant, ModelBuilder::bytes_of(values));
  }
  int filter_qu8(ModelBuilder& builder, const std::vector<std::int32_t>& shape, float scale, int zero) {
    std::size_t count = 1;
    for (const std::int32_t d : shape) count *= static_cast<std::size_t>(d);
    std::vector<std::uint8_t> values(count);
    for (std::uint8_t& v : values) v = static_cast<std::uint8_t>(uniform(0, 255));
    return builder.tensor(shape, tflite::TensorType::UINT8, {{scale}, {zero}, 0}, values);
  }
  int filter_f32(ModelBuilder& builder, const std::vector<std::int32_t>& shape, float reach) {
    std::size_t count = 1;
    for (const std::int32_t d : shape) count *= static_cast<std::size_t>(d);
    std::vector<float> values(count);
    for (float& v : values) v = real(-reach, reach);
    return builder.tensor(shape, tflite::TensorType::FLOAT32, {}, ModelBuilder::bytes_of(values));
  }
  int bias_i32(ModelBuilder& builder, int count, int reach) {
    std::vector<std::int32_t> values(static_cast<std::size_t>(count));
    for (std::int32_t& v : values) v = uniform(-reach, reach);
    return builder.int32_constant(values);
  }

 private:
  std::mt19937 random_;
};

/// Cache-line-aligned memory for a Slice.
class Memory {
 public:
  explicit Memory(std::size_t bytes) : storage_(bytes + rt::kCacheLineBytes) {
    const auto address = reinterpret_cast<std::uintptr_t>(storage_.data());
    first_ = storage_.data() + (rt::round_up(address, rt::kCacheLineBytes) - address);
    bytes_ = bytes;
  }
  [[nodiscard]] rt::Slice slice() const { return rt::Slice({first_, bytes_}); }

 private:
  std::vector<std::byte> storage_;
  std::byte* first_ = nullptr;
  std::size_t bytes_ = 0;
};

}  // namespace tactus::segment::test
