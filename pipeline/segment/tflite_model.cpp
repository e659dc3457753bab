#include "pipeline/segment/tflite_model.hpp"

#include <tflite_subset_generated.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <memory>
#include <optional>

namespace tactus::segment {
namespace {

constexpr int kTensorsCountMax = 1 << 16;
constexpr int kOperatorsCountMax = 1 << 16;
constexpr std::int32_t kWindowMax = 4096;  // strides, dilations and windows beyond this are nonsense

std::string text(const Shape& shape) {
  return "[" + std::to_string(shape.dims[0]) + "," + std::to_string(shape.dims[1]) + "," +
         std::to_string(shape.dims[2]) + "," + std::to_string(shape.dims[3]) + "]";
}

/// Names come from outside: printable and short in messages.
std::string printable(const flatbuffers::String* name) {
  std::string out;
  if (name == nullptr) return out;
  for (const char c : *name) {
    if (out.size() >= 80) break;
    out.push_back(c >= 0x20 && c < 0x7f ? c : '?');
  }
  return out;
}

/// The verifier holds vectors to the alignment of their length field, 4; a file may put longs there.
std::int64_t unaligned(const flatbuffers::Vector<std::int64_t>& values, std::uint32_t index) {
  std::int64_t value = 0;
  std::memcpy(&value, values.Data() + index * sizeof value, sizeof value);
  return flatbuffers::EndianScalar(value);
}

ElementType element_type(tflite::TensorType type) {
  switch (type) {
    case tflite::TensorType::FLOAT32:
      return ElementType::float32;
    case tflite::TensorType::INT32:
      return ElementType::int32;
    case tflite::TensorType::UINT8:
      return ElementType::uint8;
    case tflite::TensorType::INT8:
      return ElementType::int8;
    default:
      return ElementType::other;
  }
}

OperatorKind operator_kind(std::int32_t code) {
  switch (static_cast<tflite::BuiltinOperator>(code)) {
    case tflite::BuiltinOperator::ADD:
      return OperatorKind::add;
    case tflite::BuiltinOperator::AVERAGE_POOL_2D:
      return OperatorKind::average_pool;
    case tflite::BuiltinOperator::CONCATENATION:
      return OperatorKind::concatenation;
    case tflite::BuiltinOperator::CONV_2D:
      return OperatorKind::conv;
    case tflite::BuiltinOperator::DEPTHWISE_CONV_2D:
      return OperatorKind::depthwise_conv;
    case tflite::BuiltinOperator::DEQUANTIZE:
      return OperatorKind::dequantize;
    case tflite::BuiltinOperator::FULLY_CONNECTED:
      return OperatorKind::fully_connected;
    case tflite::BuiltinOperator::LOGISTIC:
      return OperatorKind::logistic;
    case tflite::BuiltinOperator::MAX_POOL_2D:
      return OperatorKind::max_pool;
    case tflite::BuiltinOperator::MUL:
      return OperatorKind::mul;
    case tflite::BuiltinOperator::RELU:
      return OperatorKind::relu;
    case tflite::BuiltinOperator::RELU6:
      return OperatorKind::relu6;
    case tflite::BuiltinOperator::RESHAPE:
      return OperatorKind::reshape;
    case tflite::BuiltinOperator::RESIZE_BILINEAR:
      return OperatorKind::resize_bilinear;
    case tflite::BuiltinOperator::SOFTMAX:
      return OperatorKind::softmax;
    case tflite::BuiltinOperator::PAD:
      return OperatorKind::pad;
    case tflite::BuiltinOperator::MEAN:
      return OperatorKind::mean;
    case tflite::BuiltinOperator::CAST:
      return OperatorKind::cast;
    case tflite::BuiltinOperator::ARG_MAX:
      return OperatorKind::arg_max;
    case tflite::BuiltinOperator::QUANTIZE:
      return OperatorKind::quantize;
    case tflite::BuiltinOperator::HARD_SWISH:
      return OperatorKind::hard_swish;
  }
  return OperatorKind::other;
}

bool has_window(OperatorKind kind) {
  return kind == OperatorKind::conv || kind == OperatorKind::depthwise_conv ||
         kind == OperatorKind::average_pool || kind == OperatorKind::max_pool;
}

/// The number of result rows (or columns) of a windowed operator; 0 when the window does not fit.
std::int32_t output_length(Padding padding, std::int32_t input, std::int32_t window, std::int32_t stride,
                           std::int32_t dilation) {
  const std::int64_t reach = static_cast<std::int64_t>(window - 1) * dilation + 1;
  if (padding == Padding::same) return (input + stride - 1) / stride;
  return reach > input ? 0 : static_cast<std::int32_t>((input - reach) / stride + 1);
}

/// Collects the first thing that is wrong.
class Reader {
 public:
  Reader(const tflite::Model& source, std::string file) : source_(source) { model_.file = std::move(file); }

  rt::Result<Model> read() {
    if (!read_graph()) return rt::Error{rt::ExitCode::bad_input, model_.file + ": " + what_};
    return std::move(model_);
  }

 private:
  bool fail(std::string what) {
    what_ = std::move(what);
    return false;
  }
  bool fail_tensor(std::size_t index, const std::string& what) {
    return fail("tensor " + std::to_string(index) + " '" + model_.tensors[index].name + "': " + what);
  }
  bool fail_operator(std::size_t index, const std::string& what) {
    const Operator& op = model_.operators[index];
    return fail("operator " + std::to_string(index) + " (" + name(op.kind) +
                (op.kind == OperatorKind::other ? " " + std::to_string(op.builtin_code) : "") + "): " + what);
  }

  bool read_graph() {
    if (source_.version() != 3)
      return fail("schema version is " + std::to_string(source_.version()) +
                  ", this program reads version 3");
    if (source_.subgraphs() == nullptr || source_.subgraphs()->size() == 0) return fail("holds no subgraph");
    if (source_.buffers() == nullptr) return fail("holds no buffers");
    const tflite::SubGraph* graph = source_.subgraphs()->Get(0);
    if (graph->tensors() == nullptr || graph->tensors()->size() == 0)
      return fail("subgraph 0 holds no tensors");
    if (graph->tensors()->size() > kTensorsCountMax) return fail("subgraph 0 holds more than 65536 tensors");
    if (graph->operators() == nullptr || graph->operators()->size() == 0)
      return fail("subgraph 0 holds no operators");
    if (graph->operators()->size() > kOperatorsCountMax)
      return fail("subgraph 0 holds more than 65536 operators");

    model_.tensors.resize(graph->tensors()->size());
    for (std::uint32_t i = 0; i < graph->tensors()->size(); ++i)
      if (!read_tensor(i, *graph->tensors()->Get(i))) return false;
    if (!read_indices(graph->inputs(), model_.inputs, false, "graph inputs")) return false;
    if (!read_indices(graph->outputs(), model_.outputs, false, "graph outputs")) return false;
    if (model_.inputs.empty()) return fail("subgraph 0 has no input");
    if (model_.outputs.empty()) return fail("subgraph 0 has no output");

    std::vector<bool> known(model_.tensors.size());
    for (std::size_t i = 0; i < known.size(); ++i) known[i] = model_.tensors[i].is_constant();
    for (const std::int32_t i : model_.inputs) {
      if (known[static_cast<std::size_t>(i)])
        return fail_tensor(static_cast<std::size_t>(i), "is a graph input and constant or named twice");
      known[static_cast<std::size_t>(i)] = true;
    }
    model_.operators.resize(graph->operators()->size());
    for (std::uint32_t i = 0; i < graph->operators()->size(); ++i)
      if (!read_operator(i, *graph->operators()->Get(i), known)) return false;
    for (const std::int32_t i : model_.outputs)
      if (!known[static_cast<std::size_t>(i)])
        return fail_tensor(static_cast<std::size_t>(i), "is a graph output and never computed");
    return true;
  }

  bool read_indices(const flatbuffers::Vector<std::int32_t>* from, std::vector<std::int32_t>& to,
                    bool optional, const std::string& where) {
    if (from == nullptr) return true;
    for (const std::int32_t index : *from) {
      const bool absent = optional && index == -1;
      if (!absent && (index < 0 || static_cast<std::size_t>(index) >= model_.tensors.size()))
        return fail(where + ": tensor index " + std::to_string(index) + " is outside 0.." +
                    std::to_string(model_.tensors.size() - 1));
      to.push_back(index);
    }
    return true;
  }

  bool read_tensor(std::size_t index, const tflite::Tensor& from) {
    Tensor& to = model_.tensors[index];
    to.name = printable(from.name());
    to.type = element_type(from.type());
    const std::uint32_t rank = from.shape() == nullptr ? 0 : from.shape()->size();
    to.rank = static_cast<int>(std::min<std::uint32_t>(rank, 5));
    if (rank <= 4) {
      std::size_t elements = 1;
      for (std::uint32_t d = 0; d < rank; ++d) {
        const std::int32_t length = from.shape()->Get(d);
        if (length < 1)
          return fail_tensor(index, "dimension " + std::to_string(d) + " is " + std::to_string(length) +
                                        ", only fixed shapes of at least 1 can be run");
        if (static_cast<std::size_t>(length) > kElementsCountMax / elements)
          return fail_tensor(index, "has more than 2^27 elements");
        elements *= static_cast<std::size_t>(length);
        to.shape.dims[4 - rank + d] = length;
      }
    } else {
      to.type = ElementType::other;  // an operator that is needed will refuse it by name
    }
    return read_constant(index, from) && read_quantization(index, from.quantization());
  }

  bool read_constant(std::size_t index, const tflite::Tensor& from) {
    Tensor& to = model_.tensors[index];
    if (from.buffer() >= source_.buffers()->size())
      return fail_tensor(index, "buffer " + std::to_string(from.buffer()) + " is outside 0.." +
                                    std::to_string(source_.buffers()->size()) + " (exclusive)");
    const auto* data = source_.buffers()->Get(from.buffer())->data();
    if (data == nullptr || data->size() == 0) return true;
    const std::size_t bytes = to.shape.elements_count() * bytes_per_element(to.type);
    if (to.type != ElementType::other && data->size() != bytes)
      return fail_tensor(index, "its buffer holds " + std::to_string(data->size()) + " bytes, its shape " +
                                    text(to.shape) + " needs " + std::to_string(bytes));
    to.constant = std::as_bytes(std::span(data->data(), data->size()));
    return true;
  }

  bool read_quantization(std::size_t index, const tflite::QuantizationParameters* from) {
    if (from == nullptr || from->scale() == nullptr || from->scale()->size() == 0) return true;
    Tensor& to = model_.tensors[index];
    if (to.type != ElementType::int8 && to.type != ElementType::uint8 && to.type != ElementType::int32)
      return true;
    const std::uint32_t count = from->scale()->size();
    const std::uint32_t zero_count = from->zero_point() == nullptr ? 0 : from->zero_point()->size();
    if (zero_count != 0 && zero_count != count)
      return fail_tensor(
          index, std::to_string(count) + " scales but " + std::to_string(zero_count) + " zero points");
    if (count > 1) {
      const std::int32_t dimension = from->quantized_dimension();
      if (dimension < 0 || dimension >= to.rank)
        return fail_tensor(index,
                           "quantised dimension " + std::to_string(dimension) + " is outside its shape");
      to.quantization.dimension = 4 - to.rank + dimension;
      const std::int32_t length = to.shape.dims[static_cast<std::size_t>(to.quantization.dimension)];
      if (count != static_cast<std::uint32_t>(length))
        return fail_tensor(index,
                           std::to_string(count) + " scales for " + std::to_string(length) + " slices");
    }
    const std::int64_t low = to.type == ElementType::uint8  ? 0
                             : to.type == ElementType::int8 ? -128
                                                            : INT32_MIN;
    const std::int64_t high = to.type == ElementType::uint8  ? 255
                              : to.type == ElementType::int8 ? 127
                                                             : INT32_MAX;
    for (std::uint32_t i = 0; i < count; ++i) {
      const float scale = from->scale()->Get(i);
      if (!(scale > 0) || !std::isnormal(scale))
        return fail_tensor(index, "scale " + std::to_string(i) + " is not a positive number");
      const std::int64_t zero = zero_count == 0 ? 0 : unaligned(*from->zero_point(), i);
      if (zero < low || zero > high)
        return fail_tensor(index, "zero point " + std::to_string(zero) + " does not fit its type");
      to.quantization.scales.push_back(scale);
      to.quantization.zero_points.push_back(static_cast<std::int32_t>(zero));
    }
    return true;
  }

  bool read_operator(std::size_t index, const tflite::Operator& from, std::vector<bool>& known) {
    Operator& to = model_.operators[index];
    const auto* codes = source_.operator_codes();
    if (codes == nullptr || from.opcode_index() >= codes->size())
      return fail("operator " + std::to_string(index) + ": operator code " +
                  std::to_string(from.opcode_index()) + " is not in the file's list");
    const tflite::OperatorCode* code = codes->Get(from.opcode_index());
    to.builtin_code = std::max(static_cast<std::int32_t>(code->deprecated_builtin_code()),
                               static_cast<std::int32_t>(code->builtin_code()));
    to.kind = operator_kind(to.builtin_code);
    const std::string where = "operator " + std::to_string(index) + " (" + name(to.kind) + ")";
    if (!read_indices(from.inputs(), to.inputs, true, where)) return false;
    if (!read_indices(from.outputs(), to.outputs, false, where)) return false;
    for (const std::int32_t input : to.inputs)
      if (input >= 0 && !known[static_cast<std::size_t>(input)])
        return fail_operator(index, "reads tensor " + std::to_string(input) + " before anything computes it");
    for (const std::int32_t output : to.outputs) {
      if (known[static_cast<std::size_t>(output)])
        return fail_operator(index, "writes tensor " + std::to_string(output) +
                                        ", which is constant, an input or already computed");
      known[static_cast<std::size_t>(output)] = true;
    }
    return read_options(index, from) && check_shapes(index);
  }

  bool read_activation(std::size_t index, tflite::Activation activation) {
    switch (activation) {
      case tflite::Activation::NONE:
        model_.operators[index].activation = Activation::none;
        return true;
      case tflite::Activation::RELU:
        model_.operators[index].activation = Activation::relu;
        return true;
      case tflite::Activation::RELU6:
        model_.operators[index].activation = Activation::relu6;
        return true;
      default:
        return fail_operator(index, "fused activation " + std::to_string(static_cast<int>(activation)) +
                                        " is not none, ReLU or ReLU6");
    }
  }

  /// Options that an operator needs and does not have would read as zeros; a stride of zero is then refused.
  bool read_options(std::size_t index, const tflite::Operator& from) {
    Operator& to = model_.operators[index];
    std::optional<tflite::Padding> padding;
    if (const auto* conv = from.builtin_options_as_Conv2DOptions();
        conv != nullptr && to.kind == OperatorKind::conv) {
      padding = conv->padding();
      to.stride_h = conv->stride_h();
      to.stride_w = conv->stride_w();
      to.dilation_h = conv->dilation_h();
      to.dilation_w = conv->dilation_w();
      if (!read_activation(index, conv->activation())) return false;
    } else if (const auto* dw = from.builtin_options_as_DepthwiseConv2DOptions();
               dw != nullptr && to.kind == OperatorKind::depthwise_conv) {
      padding = dw->padding();
      to.stride_h = dw->stride_h();
      to.stride_w = dw->stride_w();
      to.dilation_h = dw->dilation_h();
      to.dilation_w = dw->dilation_w();
      if (!read_activation(index, dw->activation())) return false;
    } else if (const auto* pool = from.builtin_options_as_Pool2DOptions();
               pool != nullptr &&
               (to.kind == OperatorKind::average_pool || to.kind == OperatorKind::max_pool)) {
      padding = pool->padding();
      to.stride_h = pool->stride_h();
      to.stride_w = pool->stride_w();
      to.window_h = pool->filter_height();
      to.window_w = pool->filter_width();
      if (!read_activation(index, pool->activation())) return false;
    } else if (has_window(to.kind)) {
      return fail_operator(index, "its options are missing or of another operator");
    }
    if (padding.has_value()) {
      if (*padding != tflite::Padding::SAME && *padding != tflite::Padding::VALID)
        return fail_operator(index, "padding is neither SAME nor VALID");
      to.padding = *padding == tflite::Padding::SAME ? Padding::same : Padding::valid;
      for (const std::int32_t n :
           {to.stride_h, to.stride_w, to.dilation_h, to.dilation_w, to.window_h, to.window_w})
        if (n < 1 || n > kWindowMax)
          return fail_operator(index,
                               "stride, dilation or window is " + std::to_string(n) + ", outside 1..4096");
    }
    if (const auto* fc = from.builtin_options_as_FullyConnectedOptions();
        fc != nullptr && to.kind == OperatorKind::fully_connected)
      return read_activation(index, fc->activation());
    if (const auto* add = from.builtin_options_as_AddOptions();
        add != nullptr && to.kind == OperatorKind::add)
      return read_activation(index, add->activation());
    if (const auto* mul = from.builtin_options_as_MulOptions();
        mul != nullptr && to.kind == OperatorKind::mul)
      return read_activation(index, mul->activation());
    if (const auto* resize = from.builtin_options_as_ResizeBilinearOptions();
        resize != nullptr && to.kind == OperatorKind::resize_bilinear) {
      to.align_corners = resize->align_corners();
      to.half_pixel_centers = resize->half_pixel_centers();
      if (to.align_corners && to.half_pixel_centers)
        return fail_operator(index, "align_corners and half_pixel_centers exclude each other");
    }
    if (to.kind == OperatorKind::concatenation) {
      const auto* concat = from.builtin_options_as_ConcatenationOptions();
      if (concat == nullptr) return fail_operator(index, "its options are missing");
      if (!read_activation(index, concat->activation())) return false;
      if (to.outputs.size() == 1) {
        const int rank = model_.tensors[static_cast<std::size_t>(to.outputs[0])].rank;
        if (concat->axis() != -1 && concat->axis() != rank - 1)
          return fail_operator(index, "joins along axis " + std::to_string(concat->axis()) +
                                          ", only the channel axis is supported");
      }
    }
    return true;
  }

  const Tensor* input(const Operator& op, std::size_t i) const {
    return i < op.inputs.size() && op.inputs[i] >= 0 ? &model_.tensors[static_cast<std::size_t>(op.inputs[i])]
                                                     : nullptr;
  }

  bool check_shapes(std::size_t index) {
    Operator& op = model_.operators[index];
    if (op.kind == OperatorKind::other) return true;
    if (op.outputs.size() != 1) return fail_operator(index, "must have one output");
    const Tensor* in = input(op, 0);
    if (in == nullptr) return fail_operator(index, "its first input is missing");
    const Tensor& out = model_.tensors[static_cast<std::size_t>(op.outputs[0])];
    if (in->rank > 4 || out.rank > 4) return fail_operator(index, "tensors of more than 4 dimensions");
    const auto unexpected = [&](const Tensor& t, const std::string& expected) {
      return fail_operator(index,
                           "tensor '" + t.name + "' has shape " + text(t.shape) + ", expected " + expected);
    };
    switch (op.kind) {
      case OperatorKind::conv:
      case OperatorKind::depthwise_conv:
      case OperatorKind::fully_connected:
        return check_filter(index, *in, out);
      case OperatorKind::average_pool:
      case OperatorKind::max_pool:
        return check_window(index, *in, out, in->shape.channels());
      case OperatorKind::add:
      case OperatorKind::mul: {
        const Tensor* second = input(op, 1);
        if (second == nullptr) return fail_operator(index, "its second input is missing");
        for (std::size_t d = 0; d < 4; ++d) {
          const std::int32_t a = in->shape.dims[d], b = second->shape.dims[d], o = out.shape.dims[d];
          if (o != std::max(a, b) || (a != o && a != 1) || (b != o && b != 1))
            return unexpected(out,
                              "what " + text(in->shape) + " and " + text(second->shape) + " broadcast to");
        }
        return true;
      }
      case OperatorKind::concatenation: {
        std::int64_t channels = 0;
        for (std::size_t i = 0; i < op.inputs.size(); ++i) {
          const Tensor* part = input(op, i);
          if (part == nullptr) return fail_operator(index, "an input is missing");
          Shape expected = out.shape;
          expected.dims[3] = part->shape.channels();
          if (!(part->shape == expected)) return unexpected(*part, text(expected));
          channels += part->shape.channels();
        }
        if (channels != out.shape.channels()) return unexpected(out, std::to_string(channels) + " channels");
        return true;
      }
      case OperatorKind::resize_bilinear: {
        const Tensor* size = input(op, 1);
        if (size == nullptr || size->type != ElementType::int32 || size->constant.size() != 8)
          return fail_operator(index, "its size must be a constant of two int32");
        if (in->shape.channels() != out.shape.channels() || in->shape.dims[0] != out.shape.dims[0])
          return unexpected(out, "the channels of " + text(in->shape));
        return true;
      }
      case OperatorKind::pad: {
        const Tensor* margins = input(op, 1);
        if (margins == nullptr || margins->type != ElementType::int32 || margins->constant.size() != 32 ||
            in->rank != 4)
          return fail_operator(index, "its margins must be a constant of four pairs of int32");
        const std::vector<std::int32_t> m = constant_values<std::int32_t>(*margins);
        for (std::size_t d = 0; d < 4; ++d) {
          const std::int32_t before = m[2 * d], after = m[2 * d + 1];
          if (before < 0 || after < 0 || before > kWindowMax || after > kWindowMax)
            return fail_operator(index, "a margin is outside 0..4096");
          if ((d == 0 || d == 3) && (before != 0 || after != 0))
            return fail_operator(index, "pads batch or channels, only rows and columns are supported");
          if (in->shape.dims[d] + before + after != out.shape.dims[d])
            return unexpected(out, text(in->shape) + " plus its margins");
        }
        return true;
      }
      case OperatorKind::mean: {
        const Tensor* axes = input(op, 1);
        if (axes == nullptr || axes->type != ElementType::int32 || axes->constant.size() != 8 ||
            in->rank != 4)
          return fail_operator(index, "its axes must be a constant of two int32");
        std::vector<std::int32_t> a = constant_values<std::int32_t>(*axes);
        for (std::int32_t& axis : a)
          if (axis < 0) axis = axis < -4 ? axis : axis + 4;
        std::sort(a.begin(), a.end());
        if (a[0] != 1 || a[1] != 2)
          return fail_operator(index, "only the mean over rows and columns is supported");
        if (out.shape.elements_count() != static_cast<std::size_t>(in->shape.channels()) ||
            out.shape.channels() != in->shape.channels())
          return unexpected(out, "one value per channel of " + text(in->shape));
        return true;
      }
      case OperatorKind::reshape:
        if (in->shape.elements_count() != out.shape.elements_count())
          return unexpected(out, "as many elements as " + text(in->shape));
        return true;
      case OperatorKind::logistic:
      case OperatorKind::relu:
      case OperatorKind::relu6:
      case OperatorKind::softmax:
      case OperatorKind::cast:
      case OperatorKind::quantize:
      case OperatorKind::dequantize:
      case OperatorKind::hard_swish:
        if (!(in->shape == out.shape)) return unexpected(out, text(in->shape));
        return true;
      case OperatorKind::arg_max:
      case OperatorKind::other:
        return true;
    }
    return true;
  }

  template <typename T>
  static std::vector<T> constant_values(const Tensor& tensor) {
    std::vector<T> values(tensor.constant.size() / sizeof(T));
    std::copy_n(tensor.constant.begin(), values.size() * sizeof(T),
                reinterpret_cast<std::byte*>(values.data()));
    return values;
  }

  bool check_filter(std::size_t index, const Tensor& in, const Tensor& out) {
    Operator& op = model_.operators[index];
    const Tensor* filter = input(op, 1);
    if (filter == nullptr || !filter->is_constant())
      return fail_operator(index, "its filter must be a constant");
    const std::array<std::int32_t, 4> f = filter->shape.dims;
    std::int32_t outputs_count = 0;
    if (op.kind == OperatorKind::conv) {
      outputs_count = f[0];
      if (f[3] != in.shape.channels())
        return fail_operator(index, "its filter reads " + std::to_string(f[3]) + " channels, its input has " +
                                        std::to_string(in.shape.channels()) +
                                        " (grouped convolution is not supported)");
    } else if (op.kind == OperatorKind::depthwise_conv) {
      outputs_count = f[3];
      if (f[0] != 1 || f[3] % in.shape.channels() != 0)
        return fail_operator(index, "its filter has shape " + text(filter->shape) + " for an input of " +
                                        std::to_string(in.shape.channels()) + " channels");
    } else {
      outputs_count = f[2];
      if (f[0] != 1 || f[1] != 1 || in.shape.elements_count() != static_cast<std::size_t>(f[3]))
        return fail_operator(index, "its weights of shape " + text(filter->shape) +
                                        " do not fit an input of " +
                                        std::to_string(in.shape.elements_count()) + " values");
    }
    if (const Tensor* bias = input(op, 2); bias != nullptr) {
      if (!bias->is_constant()) return fail_operator(index, "its bias must be a constant");
      if (bias->shape.elements_count() != static_cast<std::size_t>(outputs_count))
        return fail_operator(index, "its bias has " + std::to_string(bias->shape.elements_count()) +
                                        " values for " + std::to_string(outputs_count) + " output channels");
    }
    if (op.kind == OperatorKind::fully_connected) {
      if (out.shape.elements_count() != static_cast<std::size_t>(outputs_count))
        return fail_operator(index, "its output of " + std::to_string(out.shape.elements_count()) +
                                        " values does not fit its weights");
      return true;
    }
    op.window_h = f[1];
    op.window_w = f[2];
    if (f[1] > kWindowMax || f[2] > kWindowMax) return fail_operator(index, "its filter is larger than 4096");
    return check_window(index, in, out, outputs_count);
  }

  bool check_window(std::size_t index, const Tensor& in, const Tensor& out, std::int32_t channels) {
    const Operator& op = model_.operators[index];
    Shape expected;
    expected.dims = {in.shape.dims[0],
                     output_length(op.padding, in.shape.height(), op.window_h, op.stride_h, op.dilation_h),
                     output_length(op.padding, in.shape.width(), op.window_w, op.stride_w, op.dilation_w),
                     channels};
    if (!(out.shape == expected))
      return fail_operator(
          index, "tensor '" + out.name + "' has shape " + text(out.shape) + ", expected " + text(expected));
    return true;
  }

  const tflite::Model& source_;
  Model model_;
  std::string what_;
};

}  // namespace

std::size_t bytes_per_element(ElementType type) {
  switch (type) {
    case ElementType::float32:
    case ElementType::int32:
      return 4;
    case ElementType::uint8:
    case ElementType::int8:
      return 1;
    case ElementType::other:
      return 0;
  }
  return 0;
}

std::size_t Shape::elements_count() const {
  std::size_t count = 1;
  for (const std::int32_t d : dims) count *= static_cast<std::size_t>(d);
  return count;
}

const char* name(OperatorKind kind) {
  constexpr std::array kNames = {"ADD",
                                 "AVERAGE_POOL_2D",
                                 "CONCATENATION",
                                 "CONV_2D",
                                 "DEPTHWISE_CONV_2D",
                                 "DEQUANTIZE",
                                 "FULLY_CONNECTED",
                                 "LOGISTIC",
                                 "MAX_POOL_2D",
                                 "MUL",
                                 "RELU",
                                 "RELU6",
                                 "RESHAPE",
                                 "RESIZE_BILINEAR",
                                 "SOFTMAX",
                                 "PAD",
                                 "MEAN",
                                 "CAST",
                                 "ARG_MAX",
                                 "QUANTIZE",
                                 "HARD_SWISH",
                                 "builtin"};
  static_assert(kNames.size() == static_cast<std::size_t>(OperatorKind::other) + 1);
  return kNames[static_cast<std::size_t>(kind)];
}

Margins margins_of(const Operator& op, const Shape& input, const Shape& output) {
  if (op.padding == Padding::valid) return {};
  const auto total = [](std::int32_t in, std::int32_t out, std::int32_t window, std::int32_t stride,
                        std::int32_t dilation) {
    return std::max((out - 1) * stride + (window - 1) * dilation + 1 - in, 0);
  };
  const std::int32_t rows = total(input.height(), output.height(), op.window_h, op.stride_h, op.dilation_h);
  const std::int32_t columns = total(input.width(), output.width(), op.window_w, op.stride_w, op.dilation_w);
  return {rows / 2, columns - columns / 2, rows - rows / 2, columns / 2};
}

rt::Result<Model> read_tflite(std::span<const std::byte> bytes, const std::string& file) {
  TACTUS_ASSERT(reinterpret_cast<std::uintptr_t>(bytes.data()) % 16 == 0);
  const auto* data = reinterpret_cast<const std::uint8_t*>(bytes.data());
  const auto bad = [&](const char* what) { return rt::Error{rt::ExitCode::bad_input, file + ": " + what}; };
  if (bytes.size() < 16 || !tflite::ModelBufferHasIdentifier(data))
    return bad("is not a .tflite file (the identifier TFL3 is missing)");
  if (bytes.size() >= FLATBUFFERS_MAX_BUFFER_SIZE) return bad("is larger than 2 GB");
  flatbuffers::Verifier verifier(data, bytes.size());
  if (!tflite::VerifyModelBuffer(verifier))
    return bad("is damaged or cut short (an offset leads outside the file)");
  return Reader(*tflite::GetModel(data), file).read();
}

rt::Result<LoadedModel> load_model(const std::string& path) {
  const auto bad = [&](const char* what) { return rt::Error{rt::ExitCode::bad_input, path + ": " + what}; };
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"), std::fclose);
  if (file == nullptr) return bad("cannot be opened for reading; give an existing .tflite file");
  if (std::fseek(file.get(), 0, SEEK_END) != 0) return bad("is not a regular file");
  const long length = std::ftell(file.get());
  constexpr long kBytesMax = 512L << 20;
  if (length < 0 || length > kBytesMax) return bad("is not a regular file or is larger than 512 MB");
  std::rewind(file.get());
  LoadedModel loaded;
  loaded.storage.resize(static_cast<std::size_t>(length));  // operator new aligns to 16
  if (std::fread(loaded.storage.data(), 1, loaded.storage.size(), file.get()) != loaded.storage.size())
    return bad("could not be read to its end");
  auto model = read_tflite(loaded.storage, path);
  if (!model) return model.error();
  loaded.model = std::move(*model);
  return loaded;
}

}  // namespace tactus::segment
