// A neural network as a .tflite file describes it: tensors, constants and operators, checked so that whoever
// builds it may trust every index, shape and length. Reading is a pure function over bytes, so that it can be
// fuzzed.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "rt/status.hpp"

namespace tactus::segment {

enum class ElementType : std::uint8_t { float32, int32, uint8, int8, other };

/// Bytes of one element; 0 for `other`.
std::size_t bytes_per_element(ElementType type);

/// Batch, rows, columns, channels. Tensors of lower rank have leading ones; batch is 1 for every activation.
struct Shape {
  std::array<std::int32_t, 4> dims = {1, 1, 1, 1};
  [[nodiscard]] int height() const { return dims[1]; }
  [[nodiscard]] int width() const { return dims[2]; }
  [[nodiscard]] int channels() const { return dims[3]; }
  [[nodiscard]] std::size_t elements_count() const;
  friend bool operator==(const Shape&, const Shape&) = default;
};

/// real = scale * (quantised - zero_point). One scale, or one per slice of dimension `dimension` (an index
/// into dims).
struct Quantization {
  std::vector<float> scales;
  std::vector<std::int32_t> zero_points;
  int dimension = 0;
};

struct Tensor {
  std::string name;
  ElementType type = ElementType::other;
  Shape shape;
  int rank = 0;
  Quantization quantization;            // empty scales: not quantised
  std::span<const std::byte> constant;  // into the file's bytes, any alignment; empty: computed
  [[nodiscard]] bool is_constant() const { return !constant.empty(); }
  [[nodiscard]] float scale() const { return quantization.scales.empty() ? 0.0F : quantization.scales[0]; }
  [[nodiscard]] std::int32_t zero_point() const {
    return quantization.zero_points.empty() ? 0 : quantization.zero_points[0];
  }
};

enum class OperatorKind : std::uint8_t {
  add,
  average_pool,
  concatenation,
  conv,
  depthwise_conv,
  dequantize,
  fully_connected,
  logistic,
  max_pool,
  mul,
  relu,
  relu6,
  reshape,
  resize_bilinear,
  softmax,
  pad,
  mean,
  cast,
  arg_max,
  quantize,
  hard_swish,
  other
};
const char* name(OperatorKind kind);

enum class Padding : std::uint8_t { same, valid };
enum class Activation : std::uint8_t { none, relu, relu6 };

struct Operator {
  OperatorKind kind = OperatorKind::other;
  std::int32_t builtin_code = 0;     // of the public schema, for messages
  std::vector<std::int32_t> inputs;  // tensor indices; -1 where an optional input is absent
  std::vector<std::int32_t> outputs;
  Activation activation = Activation::none;
  Padding padding = Padding::same;  // conv, depthwise_conv, pools
  std::int32_t stride_h = 1, stride_w = 1;
  std::int32_t dilation_h = 1, dilation_w = 1;
  std::int32_t window_h = 1, window_w = 1;                 // filter or pooling window
  bool align_corners = false, half_pixel_centers = false;  // resize_bilinear
};

/// Rows and columns added around an input.
struct Margins {
  std::int32_t top = 0, right = 0, bottom = 0, left = 0;
};

/// What `padding` adds along both axes for a windowed operator from `input` to `output`; the odd one goes to
/// the end.
Margins margins_of(const Operator& op, const Shape& input, const Shape& output);

/// The first subgraph of a file. Invariants (checked by read_tflite):
///  - every tensor index is valid; every operator reads constants, the graph's inputs or earlier results; no
///  tensor is
///    computed twice, and no constant or graph input is computed;
///  - shapes have 0..4 dimensions, each >= 1, at most kElementsCountMax elements; a constant has exactly its
///  bytes;
///  - scales are positive and normal, zero points fit the type, and there is one scale or one per slice;
///  - operators of a known kind have the inputs, output shape, filter and bias shape that their parameters
///  imply.
/// Views into the file's bytes: they must outlive the model.
struct Model {
  std::string file;  // for messages
  std::vector<Tensor> tensors;
  std::vector<Operator> operators;
  std::vector<std::int32_t> inputs, outputs;
};

/// 2^27 elements: an int8 map of 4096 x 4096 x 8; far above any network for this device, far below overflow.
inline constexpr std::size_t kElementsCountMax = std::size_t{1} << 27;

/// Reads a model from the bytes of a .tflite file (schema version 3). `bytes` must be aligned to 16, as
/// load_model does; `file` is only used in messages. Error (bad_input): one sentence with file, operator or
/// tensor, and what is wrong. Phase: boot. Thread-safe; allocates.
rt::Result<Model> read_tflite(std::span<const std::byte> bytes, const std::string& file);

/// A model together with the bytes it looks into. Movable: the bytes stay where they are.
struct LoadedModel {
  std::vector<std::byte> storage;
  Model model;
};

/// Reads a file, then read_tflite. Error (bad_input): also when it cannot be read or is larger than 512 MB.
/// Phase: boot.
rt::Result<LoadedModel> load_model(const std::string& path);

}  // namespace tactus::segment
