#include "pipeline/segment/network.hpp"

#include <xnnpack.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <memory>
#include <new>
#include <string>
#include <vector>

#include "pipeline/segment/byte_kernels.hpp"
#include "pipeline/segment/xnn_pool.hpp"

namespace tactus::segment {

struct Network::Step {
  enum class Kind : std::uint8_t { xnn, table, copy, average_pool, pad };
  Kind kind = Kind::xnn;
  xnn_operator_t op = nullptr;       // xnn
  const ByteTable* table = nullptr;  // table
  Pixels input, output;              // the others
  std::size_t pixels_count = 0;
  std::size_t bytes_per_pixel = 0;
  AveragePool pool;
  std::array<std::uint8_t, 4> fill{};  // pad
  std::size_t fill_bytes = 1;
};

namespace {

// A dry run tries these amounts of borrowed memory for XNNPACK: 4, 32 and 256 MB. A network that needs more,
// or more than 1 GB for its tensors, is no network for this device.
constexpr std::size_t kPoolBytesFirst = std::size_t{4} << 20;
constexpr std::size_t kTensorBytesMax = std::size_t{1} << 30;
constexpr std::size_t kPoolBytesMax = std::size_t{256} << 20;
// Sums of an average pool stay in int32: 2^23 x 255 < 2^31.
constexpr std::int64_t kPoolWindowMax = std::int64_t{1} << 23;

std::size_t at(std::int32_t index) { return static_cast<std::size_t>(index); }

const char* words(xnn_status status) {
  switch (status) {
    case xnn_status_success:
      return "success";
    case xnn_status_uninitialized:
      return "not started";
    case xnn_status_invalid_parameter:
      return "invalid parameter";
    case xnn_status_invalid_state:
      return "invalid state";
    case xnn_status_unsupported_parameter:
      return "unsupported parameter (often a ratio of scales beyond its range)";
    case xnn_status_unsupported_hardware:
      return "unsupported hardware";
    case xnn_status_out_of_memory:
      return "out of memory";
  }
  return "unknown status";
}

template <typename T>
std::vector<T> constant_values(const Tensor& tensor) {
  std::vector<T> values(tensor.constant.size() / sizeof(T));
  std::memcpy(values.data(), tensor.constant.data(), values.size() * sizeof(T));
  return values;
}

struct Limits {
  std::int32_t low = 0, high = 0;
};

/// The 8-bit range that an activation leaves.
Limits limits_of(Activation activation, const Tensor& output) {
  Limits limits = output.type == ElementType::int8 ? Limits{-128, 127} : Limits{0, 255};
  const std::int32_t zero = output.zero_point();
  if (activation != Activation::none) limits.low = std::max(limits.low, zero);
  if (activation == Activation::relu6) {
    const double six = std::min(6.0 / static_cast<double>(output.scale()) + 0.5, 1000.0);
    limits.high = std::min(limits.high, zero + static_cast<std::int32_t>(six));
  }
  return limits;
}

float float_low(Activation activation) {
  return activation == Activation::none ? -std::numeric_limits<float>::infinity() : 0.0F;
}
float float_high(Activation activation) {
  return activation == Activation::relu6 ? 6.0F : std::numeric_limits<float>::infinity();
}

/// Creates and sets up the operators of a plan, one after the other.
class Builder {
 public:
  using Step = Network::Step;

  Builder(const Model& model, const NetworkPlan& plan, std::byte* tensors, std::span<Step> steps,
          std::span<ByteTable> tables)
      : model_(model), plan_(plan), tensors_(tensors), steps_(steps), tables_(tables) {}

  rt::Result<void> build() {
    write_constants();
    for (const std::int32_t i : plan_.operators) {
      index_ = i;
      what_.clear();
      const Operator& op = model_.operators[at(i)];
      if (!build_operator(op)) {
        std::string message =
            model_.file + ": operator " + std::to_string(i) + " (" + name(op.kind) + "): " + what_;
        return rt::Error{out_of_memory_ ? rt::ExitCode::bad_usage : rt::ExitCode::bad_input,
                         std::move(message)};
      }
    }
    return {};
  }
  [[nodiscard]] std::size_t steps_count() const { return steps_count_; }

 private:
  bool fail(std::string what) {
    what_ = std::move(what);
    return false;
  }
  bool check(xnn_status status) {
    if (status == xnn_status_success) return true;
    out_of_memory_ = status == xnn_status_out_of_memory;
    if (out_of_memory_)
      return fail("XNNPACK's share of the network's memory is full; plan more bytes for the network");
    return fail(std::string("XNNPACK refuses it: ") + words(status));
  }

  const Tensor& tensor(std::int32_t index) const { return model_.tensors[at(index)]; }
  std::byte* address(std::int32_t index) const {
    const Placement& placement = plan_.placements[at(index)];
    return tensors_ + plan_.blocks[at(placement.block)].offset_bytes + placement.offset_bytes;
  }
  template <typename T>
  T* address_as(std::int32_t index) const {
    return reinterpret_cast<T*>(address(index));
  }
  std::size_t stride(std::int32_t index) const { return plan_.placements[at(index)].pixel_stride; }
  Pixels pixels(std::int32_t index) const {
    return {address_as<std::uint8_t>(index), stride(index) * bytes_per_element(tensor(index).type)};
  }
  bool is_quantized(const Tensor& t) const {
    return (t.type == ElementType::int8 || t.type == ElementType::uint8) && t.quantization.scales.size() == 1;
  }
  static ByteFormat format(const Tensor& t) { return {t.type, t.scale(), t.zero_point()}; }

  Step& add_step(Step::Kind kind) {
    TACTUS_ASSERT(steps_count_ < steps_.size());
    Step& step = steps_[steps_count_++];
    step = Step{};
    step.kind = kind;
    return step;
  }
  void add_xnn_step(xnn_operator_t op) { add_step(Step::Kind::xnn).op = op; }

  void write_constants() {
    for (std::size_t i = 0; i < model_.tensors.size(); ++i)
      if (model_.tensors[i].is_constant() && plan_.placements[i].block >= 0)
        std::memcpy(address(static_cast<std::int32_t>(i)), model_.tensors[i].constant.data(),
                    model_.tensors[i].constant.size());
  }

  bool build_operator(const Operator& op) {
    const Tensor& in = tensor(op.inputs[0]);
    const Tensor& out = tensor(op.outputs[0]);
    for (const Tensor* t : {&in, &out})
      if (t->type != ElementType::float32 && !is_quantized(*t))
        return fail("tensor '" + t->name + "' is neither float32 nor 8 bits with one scale");
    if (in.type != out.type && op.kind != OperatorKind::quantize)
      return fail("input '" + in.name + "' and output '" + out.name + "' differ in type");
    switch (op.kind) {
      case OperatorKind::conv:
      case OperatorKind::depthwise_conv:
      case OperatorKind::fully_connected:
        return build_conv(op, in, out);
      case OperatorKind::add:
        return build_binary(op, in, out, true);
      case OperatorKind::mul:
        return build_binary(op, in, out, false);
      case OperatorKind::average_pool:
      case OperatorKind::mean:
        return build_average(op, in, out);
      case OperatorKind::max_pool:
        return build_max_pool(op, in, out);
      case OperatorKind::resize_bilinear:
        return build_resize(op, in, out);
      case OperatorKind::concatenation:
        return build_concatenation(op, out);
      case OperatorKind::reshape:
        return true;  // the plan let the result lie where the input lies
      case OperatorKind::pad:
        return build_pad(op, in, out);
      case OperatorKind::relu:
      case OperatorKind::relu6:
      case OperatorKind::logistic:
      case OperatorKind::hard_swish:
      case OperatorKind::quantize:
        return in.type == ElementType::float32 || out.type == ElementType::float32
                   ? build_float_unary(op, in, out)
                   : build_table(op, in, out);
      default:
        return fail("only supported after the scores, where it is cut");
    }
  }

  bool build_conv(const Operator& op, const Tensor& in, const Tensor& out) {
    const Tensor& filter = tensor(op.inputs[1]);
    const Tensor* bias = op.inputs.size() > 2 && op.inputs[2] >= 0 ? &tensor(op.inputs[2]) : nullptr;
    if (filter.type != in.type)
      return fail("its filter '" + filter.name + "' differs from its input in type");
    const ElementType bias_type = in.type == ElementType::float32 ? ElementType::float32 : ElementType::int32;
    if (bias != nullptr && bias->type != bias_type)
      return fail("its bias '" + bias->name + "' has the wrong type");

    const bool depthwise = op.kind == OperatorKind::depthwise_conv;
    const bool full = op.kind == OperatorKind::fully_connected;
    const std::size_t in_channels =
        full ? in.shape.elements_count() : static_cast<std::size_t>(in.shape.channels());
    const std::size_t out_channels =
        full ? out.shape.elements_count() : static_cast<std::size_t>(out.shape.channels());
    if (full && stride(op.inputs[0]) != static_cast<std::size_t>(in.shape.channels()) &&
        in.shape.elements_count() != static_cast<std::size_t>(in.shape.channels()))
      return fail(
          "its input lies apart in memory");  // cannot happen: the plan keeps several pixels dense for it
    Conv conv;
    conv.margins = full ? Margins{} : margins_of(op, in.shape, out.shape);
    conv.groups = depthwise ? static_cast<std::uint32_t>(in_channels) : 1;
    conv.group_in = depthwise ? 1 : in_channels;
    conv.group_out = depthwise ? out_channels / in_channels : out_channels;
    conv.in_stride = full ? std::max(in_channels, stride(op.inputs[0])) : stride(op.inputs[0]);
    conv.out_stride = full ? std::max(out_channels, stride(op.outputs[0])) : stride(op.outputs[0]);
    conv.flags = depthwise ? XNN_FLAG_DEPTHWISE_CONVOLUTION : 0;
    conv.height = full ? 1 : static_cast<std::size_t>(in.shape.height());
    conv.width = full ? 1 : static_cast<std::size_t>(in.shape.width());
    if (in.type == ElementType::float32) return build_conv_f32(op, filter, bias, conv);
    return in.type == ElementType::int8 ? build_conv_qc8(op, in, out, filter, bias, out_channels, conv)
                                        : build_conv_qu8(op, in, out, filter, bias, conv);
  }

  struct Conv {
    Margins margins;
    std::uint32_t groups = 1;
    std::size_t group_in = 1, group_out = 1, in_stride = 1, out_stride = 1, height = 1, width = 1;
    std::uint32_t flags = 0;
  };

  static std::uint32_t u32(std::int32_t n) { return static_cast<std::uint32_t>(n); }

  bool build_conv_f32(const Operator& op, const Tensor& filter, const Tensor* bias, const Conv& c) {
    const std::vector<float> weights = constant_values<float>(filter);
    const std::vector<float> offsets = bias != nullptr ? constant_values<float>(*bias) : std::vector<float>();
    xnn_operator_t xnn = nullptr;
    if (!check(xnn_create_convolution2d_nhwc_f32(
            u32(c.margins.top), u32(c.margins.right), u32(c.margins.bottom), u32(c.margins.left),
            u32(op.window_h), u32(op.window_w), u32(op.stride_h), u32(op.stride_w), u32(op.dilation_h),
            u32(op.dilation_w), c.groups, c.group_in, c.group_out, c.in_stride, c.out_stride, weights.data(),
            bias != nullptr ? offsets.data() : nullptr, float_low(op.activation), float_high(op.activation),
            c.flags, &xnn)))
      return false;
    add_xnn_step(xnn);
    return check(xnn_setup_convolution2d_nhwc_f32(xnn, 1, c.height, c.width, address_as<float>(op.inputs[0]),
                                                  address_as<float>(op.outputs[0]), nullptr));
  }

  bool build_conv_qc8(const Operator& op, const Tensor& in, const Tensor& out, const Tensor& filter,
                      const Tensor* bias, std::size_t out_channels, const Conv& c) {
    const int channel_dimension = op.kind == OperatorKind::conv             ? 0
                                  : op.kind == OperatorKind::depthwise_conv ? 3
                                                                            : 2;
    std::vector<float> scales = filter.quantization.scales;
    if (scales.size() == 1)
      scales.assign(out_channels, scales[0]);
    else if (scales.size() != out_channels || filter.quantization.dimension != channel_dimension)
      return fail("its filter '" + filter.name + "' needs one scale, or one per output channel");
    for (const std::int32_t zero : filter.quantization.zero_points)
      if (zero != 0) return fail("its int8 filter '" + filter.name + "' has a zero point other than 0");
    const std::vector<std::int8_t> weights = constant_values<std::int8_t>(filter);
    const std::vector<std::int32_t> offsets =
        bias != nullptr ? constant_values<std::int32_t>(*bias) : std::vector<std::int32_t>();
    const Limits limits = limits_of(op.activation, out);
    xnn_operator_t xnn = nullptr;
    if (!check(xnn_create_convolution2d_nhwc_qc8(
            u32(c.margins.top), u32(c.margins.right), u32(c.margins.bottom), u32(c.margins.left),
            u32(op.window_h), u32(op.window_w), u32(op.stride_h), u32(op.stride_w), u32(op.dilation_h),
            u32(op.dilation_w), c.groups, c.group_in, c.group_out, c.in_stride, c.out_stride,
            static_cast<std::int8_t>(in.zero_point()), in.scale(), scales.data(), weights.data(),
            bias != nullptr ? offsets.data() : nullptr, static_cast<std::int8_t>(out.zero_point()),
            out.scale(), static_cast<std::int8_t>(limits.low), static_cast<std::int8_t>(limits.high), c.flags,
            &xnn)))
      return false;
    add_xnn_step(xnn);
    return check(xnn_setup_convolution2d_nhwc_qc8(xnn, 1, c.height, c.width,
                                                  address_as<std::int8_t>(op.inputs[0]),
                                                  address_as<std::int8_t>(op.outputs[0]), nullptr));
  }

  bool build_conv_qu8(const Operator& op, const Tensor& in, const Tensor& out, const Tensor& filter,
                      const Tensor* bias, const Conv& c) {
    if (filter.quantization.scales.size() != 1)
      return fail("its uint8 filter '" + filter.name + "' needs exactly one scale");
    const std::vector<std::uint8_t> weights = constant_values<std::uint8_t>(filter);
    const std::vector<std::int32_t> offsets =
        bias != nullptr ? constant_values<std::int32_t>(*bias) : std::vector<std::int32_t>();
    const Limits limits = limits_of(op.activation, out);
    xnn_operator_t xnn = nullptr;
    if (!check(xnn_create_convolution2d_nhwc_qu8(
            u32(c.margins.top), u32(c.margins.right), u32(c.margins.bottom), u32(c.margins.left),
            u32(op.window_h), u32(op.window_w), u32(op.stride_h), u32(op.stride_w), u32(op.dilation_h),
            u32(op.dilation_w), c.groups, c.group_in, c.group_out, c.in_stride, c.out_stride,
            static_cast<std::uint8_t>(in.zero_point()), in.scale(),
            static_cast<std::uint8_t>(filter.zero_point()), filter.scale(), weights.data(),
            bias != nullptr ? offsets.data() : nullptr, static_cast<std::uint8_t>(out.zero_point()),
            out.scale(), static_cast<std::uint8_t>(limits.low), static_cast<std::uint8_t>(limits.high),
            c.flags, &xnn)))
      return false;
    add_xnn_step(xnn);
    return check(xnn_setup_convolution2d_nhwc_qu8(xnn, 1, c.height, c.width,
                                                  address_as<std::uint8_t>(op.inputs[0]),
                                                  address_as<std::uint8_t>(op.outputs[0]), nullptr));
  }

  static std::array<std::size_t, 4> dims(const Shape& shape) {
    std::array<std::size_t, 4> out{};
    for (std::size_t i = 0; i < 4; ++i) out[i] = at(shape.dims[i]);
    return out;
  }

  bool build_binary(const Operator& op, const Tensor& a, const Tensor& out, bool is_add) {
    const Tensor& b = tensor(op.inputs[1]);
    if (b.type != a.type || (b.type != ElementType::float32 && !is_quantized(b)))
      return fail("input '" + b.name + "' differs from the first in type");
    const std::array<std::size_t, 4> a_dims = dims(a.shape), b_dims = dims(b.shape);
    xnn_operator_t xnn = nullptr;
    xnn_status status = xnn_status_success;
    if (a.type == ElementType::float32) {
      const auto create = is_add ? xnn_create_add_nd_f32 : xnn_create_multiply_nd_f32;
      const auto setup = is_add ? xnn_setup_add_nd_f32 : xnn_setup_multiply_nd_f32;
      status = create(float_low(op.activation), float_high(op.activation), 0, &xnn);
      if (status == xnn_status_success)
        status = setup(xnn, 4, a_dims.data(), 4, b_dims.data(), address_as<float>(op.inputs[0]),
                       address_as<float>(op.inputs[1]), address_as<float>(op.outputs[0]), nullptr);
    } else if (a.type == ElementType::int8) {
      const auto zero = [](const Tensor& t) { return static_cast<std::int8_t>(t.zero_point()); };
      const Limits limits = limits_of(op.activation, out);
      const auto create = is_add ? xnn_create_add_nd_qs8 : xnn_create_multiply_nd_qs8;
      const auto setup = is_add ? xnn_setup_add_nd_qs8 : xnn_setup_multiply_nd_qs8;
      status = create(zero(a), a.scale(), zero(b), b.scale(), zero(out), out.scale(),
                      static_cast<std::int8_t>(limits.low), static_cast<std::int8_t>(limits.high), 0, &xnn);
      if (status == xnn_status_success)
        status =
            setup(xnn, 4, a_dims.data(), 4, b_dims.data(), address_as<std::int8_t>(op.inputs[0]),
                  address_as<std::int8_t>(op.inputs[1]), address_as<std::int8_t>(op.outputs[0]), nullptr);
    } else {
      const auto zero = [](const Tensor& t) { return static_cast<std::uint8_t>(t.zero_point()); };
      const Limits limits = limits_of(op.activation, out);
      const auto create = is_add ? xnn_create_add_nd_qu8 : xnn_create_multiply_nd_qu8;
      const auto setup = is_add ? xnn_setup_add_nd_qu8 : xnn_setup_multiply_nd_qu8;
      status = create(zero(a), a.scale(), zero(b), b.scale(), zero(out), out.scale(),
                      static_cast<std::uint8_t>(limits.low), static_cast<std::uint8_t>(limits.high), 0, &xnn);
      if (status == xnn_status_success)
        status =
            setup(xnn, 4, a_dims.data(), 4, b_dims.data(), address_as<std::uint8_t>(op.inputs[0]),
                  address_as<std::uint8_t>(op.inputs[1]), address_as<std::uint8_t>(op.outputs[0]), nullptr);
    }
    if (!check(status)) return false;
    add_xnn_step(xnn);
    return true;
  }

  bool build_average(const Operator& op, const Tensor& in, const Tensor& out) {
    const bool is_mean = op.kind == OperatorKind::mean;
    AveragePool pool;
    pool.geometry = {in.shape,
                     out.shape,
                     is_mean ? in.shape.height() : op.window_h,
                     is_mean ? in.shape.width() : op.window_w,
                     op.stride_h,
                     op.stride_w,
                     is_mean ? Margins{} : margins_of(op, in.shape, out.shape)};
    if (is_mean) pool.geometry.output.dims = {1, 1, 1, in.shape.channels()};
    const PoolGeometry& g = pool.geometry;
    if (in.type == ElementType::float32) {
      if (g.window_h == 1 && g.window_w == 1) return fail("a window of one pixel is not supported");
      xnn_operator_t xnn = nullptr;
      if (!check(xnn_create_average_pooling2d_nhwc_f32(
              u32(g.margins.top), u32(g.margins.right), u32(g.margins.bottom), u32(g.margins.left),
              u32(g.window_h), u32(g.window_w), u32(g.stride_h), u32(g.stride_w), at(in.shape.channels()),
              stride(op.inputs[0]), stride(op.outputs[0]), float_low(op.activation),
              float_high(op.activation), 0, &xnn)))
        return false;
      add_xnn_step(xnn);
      return check(xnn_setup_average_pooling2d_nhwc_f32(xnn, 1, at(in.shape.height()), at(in.shape.width()),
                                                        address_as<float>(op.inputs[0]),
                                                        address_as<float>(op.outputs[0]), nullptr));
    }
    const std::int64_t window = static_cast<std::int64_t>(std::min(g.window_h, in.shape.height())) *
                                std::min(g.window_w, in.shape.width());
    if (window > kPoolWindowMax) return fail("its window is larger than 2^23 pixels");
    pool.is_signed = in.type == ElementType::int8;
    const Limits limits = limits_of(op.activation, out);
    pool.low = limits.low;
    pool.high = limits.high;
    if (is_mean) {
      pool.is_mean = true;
      pool.multiplier = fixed_multiplier(static_cast<double>(in.scale()) /
                                         (static_cast<double>(out.scale()) * static_cast<double>(window)));
      pool.input_zero = in.zero_point();
      pool.output_zero = out.zero_point();
    } else if (in.scale() != out.scale() || in.zero_point() != out.zero_point()) {
      return fail("input and output differ in quantisation");
    }
    Step& step = add_step(Step::Kind::average_pool);
    step.pool = pool;
    step.input = pixels(op.inputs[0]);
    step.output = pixels(op.outputs[0]);
    return true;
  }

  bool build_max_pool(const Operator& op, const Tensor& in, const Tensor& out) {
    if (in.type != ElementType::float32 && (in.scale() != out.scale() || in.zero_point() != out.zero_point()))
      return fail("input and output differ in quantisation");
    if (op.window_h == 1 && op.window_w == 1) return fail("a window of one pixel is not supported");
    const Margins m = margins_of(op, in.shape, out.shape);
    const std::size_t channels = at(in.shape.channels()), in_stride = stride(op.inputs[0]),
                      out_stride = stride(op.outputs[0]);
    const std::size_t height = at(in.shape.height()), width = at(in.shape.width());
    xnn_operator_t xnn = nullptr;
    const auto create = [&](auto function, auto low, auto high) {
      return function(u32(m.top), u32(m.right), u32(m.bottom), u32(m.left), u32(op.window_h),
                      u32(op.window_w), u32(op.stride_h), u32(op.stride_w), 1U, 1U, channels, in_stride,
                      out_stride, low, high, 0U, &xnn);
    };
    if (in.type == ElementType::float32) {
      if (!check(create(xnn_create_max_pooling2d_nhwc_f32, float_low(op.activation),
                        float_high(op.activation))) ||
          !check(xnn_setup_max_pooling2d_nhwc_f32(xnn, 1, height, width, address_as<float>(op.inputs[0]),
                                                  address_as<float>(op.outputs[0]), nullptr)))
        return false;
    } else if (const Limits limits = limits_of(op.activation, out); in.type == ElementType::int8) {
      if (!check(create(xnn_create_max_pooling2d_nhwc_s8, static_cast<std::int8_t>(limits.low),
                        static_cast<std::int8_t>(limits.high))) ||
          !check(xnn_setup_max_pooling2d_nhwc_s8(xnn, 1, height, width, address_as<std::int8_t>(op.inputs[0]),
                                                 address_as<std::int8_t>(op.outputs[0]), nullptr)))
        return false;
    } else {
      if (!check(create(xnn_create_max_pooling2d_nhwc_u8, static_cast<std::uint8_t>(limits.low),
                        static_cast<std::uint8_t>(limits.high))) ||
          !check(xnn_setup_max_pooling2d_nhwc_u8(xnn, 1, height, width,
                                                 address_as<std::uint8_t>(op.inputs[0]),
                                                 address_as<std::uint8_t>(op.outputs[0]), nullptr)))
        return false;
    }
    add_xnn_step(xnn);
    return true;
  }

  bool build_resize(const Operator& op, const Tensor& in, const Tensor& out) {
    if (in.type != ElementType::float32 && (in.scale() != out.scale() || in.zero_point() != out.zero_point()))
      return fail("input and output differ in quantisation");
    const std::uint32_t flags = op.align_corners        ? XNN_FLAG_ALIGN_CORNERS
                                : op.half_pixel_centers ? 0
                                                        : XNN_FLAG_TENSORFLOW_LEGACY_MODE;
    const std::size_t channels = at(in.shape.channels()), in_stride = stride(op.inputs[0]),
                      out_stride = stride(op.outputs[0]);
    const std::size_t in_h = at(in.shape.height()), in_w = at(in.shape.width()),
                      out_h = at(out.shape.height()), out_w = at(out.shape.width());
    xnn_operator_t xnn = nullptr;
    if (in.type == ElementType::float32) {
      if (!check(xnn_create_resize_bilinear2d_nhwc_f32(channels, in_stride, out_stride, flags, &xnn)) ||
          !check(xnn_setup_resize_bilinear2d_nhwc_f32(xnn, 1, in_h, in_w, out_h, out_w,
                                                      address_as<float>(op.inputs[0]),
                                                      address_as<float>(op.outputs[0]), nullptr)))
        return false;
    } else if (in.type == ElementType::int8) {
      if (!check(xnn_create_resize_bilinear2d_nhwc_s8(channels, in_stride, out_stride, flags, &xnn)) ||
          !check(xnn_setup_resize_bilinear2d_nhwc_s8(xnn, 1, in_h, in_w, out_h, out_w,
                                                     address_as<std::int8_t>(op.inputs[0]),
                                                     address_as<std::int8_t>(op.outputs[0]), nullptr)))
        return false;
    } else {
      if (!check(xnn_create_resize_bilinear2d_nhwc_u8(channels, in_stride, out_stride, flags, &xnn)) ||
          !check(xnn_setup_resize_bilinear2d_nhwc_u8(xnn, 1, in_h, in_w, out_h, out_w,
                                                     address_as<std::uint8_t>(op.inputs[0]),
                                                     address_as<std::uint8_t>(op.outputs[0]), nullptr)))
        return false;
    }
    add_xnn_step(xnn);
    return true;
  }

  bool build_concatenation(const Operator& op, const Tensor& out) {
    if (op.activation != Activation::none) return fail("a fused activation is not supported");
    std::size_t channels_before = 0;
    for (const std::int32_t part : op.inputs) {
      const Tensor& t = tensor(part);
      if (t.type != out.type || (t.type != ElementType::float32 && !is_quantized(t)))
        return fail("input '" + t.name + "' differs from the output in type");
      const std::size_t element_bytes = bytes_per_element(out.type);
      Pixels target = pixels(op.outputs[0]);
      target.first += channels_before * element_bytes;
      channels_before += at(t.shape.channels());
      if (address_as<std::uint8_t>(part) == target.first) continue;  // computed in place
      const bool same =
          t.type == ElementType::float32 || (t.scale() == out.scale() && t.zero_point() == out.zero_point());
      Step& step = add_step(same ? Step::Kind::copy : Step::Kind::table);
      if (!same) {
        const Limits limits = limits_of(Activation::none, out);
        step.table = &add_table(requantize_table(format(t), format(out), limits.low, limits.high));
      }
      step.input = pixels(part);
      step.output = target;
      step.pixels_count = at(t.shape.height()) * at(t.shape.width());
      step.bytes_per_pixel = at(t.shape.channels()) * element_bytes;
    }
    return true;
  }

  const ByteTable& add_table(const ByteTable& table) {
    TACTUS_ASSERT(tables_count_ < tables_.size());
    return tables_[tables_count_++] = table;
  }

  bool build_table(const Operator& op, const Tensor& in, const Tensor& out) {
    Step& step = add_step(Step::Kind::table);
    const Activation activation = op.kind == OperatorKind::relu    ? Activation::relu
                                  : op.kind == OperatorKind::relu6 ? Activation::relu6
                                                                   : Activation::none;
    const Limits limits = limits_of(activation, out);
    step.table = &add_table(op.kind == OperatorKind::logistic ? logistic_table(format(in), format(out))
                            : op.kind == OperatorKind::hard_swish
                                ? hard_swish_table(format(in), format(out))
                                : requantize_table(format(in), format(out), limits.low, limits.high));
    step.input = pixels(op.inputs[0]);
    step.output = pixels(op.outputs[0]);
    step.pixels_count = at(in.shape.height()) * at(in.shape.width());
    step.bytes_per_pixel = at(in.shape.channels());
    return true;
  }

  bool build_float_unary(const Operator& op, const Tensor& in, const Tensor& out) {
    if (in.type != out.type) return fail("conversion between float and 8 bits is only supported at the ends");
    const std::size_t channels = at(in.shape.channels()), in_stride = stride(op.inputs[0]),
                      out_stride = stride(op.outputs[0]);
    const std::size_t pixels_count = at(in.shape.height()) * at(in.shape.width());
    const float* input = address_as<float>(op.inputs[0]);
    float* output = address_as<float>(op.outputs[0]);
    xnn_operator_t xnn = nullptr;
    switch (op.kind) {
      case OperatorKind::relu:
      case OperatorKind::relu6: {
        const Activation activation = op.kind == OperatorKind::relu ? Activation::relu : Activation::relu6;
        if (!check(xnn_create_clamp_nc_f32(channels, in_stride, out_stride, float_low(activation),
                                           float_high(activation), 0, &xnn)) ||
            !check(xnn_setup_clamp_nc_f32(xnn, pixels_count, input, output, nullptr)))
          return false;
        break;
      }
      case OperatorKind::logistic:
        if (!check(xnn_create_sigmoid_nc_f32(channels, in_stride, out_stride, 0, &xnn)) ||
            !check(xnn_setup_sigmoid_nc_f32(xnn, pixels_count, input, output, nullptr)))
          return false;
        break;
      case OperatorKind::hard_swish:
        if (!check(xnn_create_hardswish_nc_f32(channels, in_stride, out_stride, 0, &xnn)) ||
            !check(xnn_setup_hardswish_nc_f32(xnn, pixels_count, input, output, nullptr)))
          return false;
        break;
      default:
        return fail("float32 is not supported here");
    }
    add_xnn_step(xnn);
    return true;
  }

  bool build_pad(const Operator& op, const Tensor& in, const Tensor& out) {
    if (in.type != ElementType::float32 && (in.scale() != out.scale() || in.zero_point() != out.zero_point()))
      return fail("input and output differ in quantisation");
    const std::vector<std::int32_t> m = constant_values<std::int32_t>(tensor(op.inputs[1]));
    Step& step = add_step(Step::Kind::pad);
    step.input = pixels(op.inputs[0]);
    step.output = pixels(op.outputs[0]);
    step.pool.geometry.input = in.shape;
    step.pool.geometry.output = out.shape;
    step.pool.geometry.margins = {m[2], m[5], m[3], m[4]};
    step.fill_bytes = bytes_per_element(in.type);
    if (in.type != ElementType::float32) step.fill[0] = static_cast<std::uint8_t>(in.zero_point());
    return true;
  }

  const Model& model_;
  const NetworkPlan& plan_;
  std::byte* tensors_;
  std::span<Step> steps_;
  std::span<ByteTable> tables_;
  std::size_t steps_count_ = 0, tables_count_ = 0;
  std::int32_t index_ = 0;
  std::string what_;
  bool out_of_memory_ = false;
};

struct Counts {
  std::size_t steps = 0, tables = 0;
};

/// An upper bound: a concatenation makes at most one step and one table per input, anything else one.
Counts count(const Model& model, const NetworkPlan& plan) {
  Counts counts;
  for (const std::int32_t i : plan.operators) {
    const Operator& op = model.operators[at(i)];
    const std::size_t n = op.kind == OperatorKind::concatenation ? op.inputs.size() : 1;
    counts.steps += n;
    const bool no_table = op.kind == OperatorKind::conv || op.kind == OperatorKind::depthwise_conv ||
                          op.kind == OperatorKind::add || op.kind == OperatorKind::resize_bilinear;
    counts.tables += no_table ? 0 : n;
  }
  return counts;
}

std::size_t fixed_bytes(const NetworkPlan& plan, const Counts& counts) {
  return rt::bytes_of<Network::Step>(counts.steps) + rt::bytes_of<ByteTable>(counts.tables) +
         rt::bytes_of<std::byte>(plan.tensor_bytes);
}

TensorView view(const Model& model, const NetworkPlan& plan, std::byte* tensors, std::int32_t index) {
  const Tensor& t = model.tensors[at(index)];
  const Placement& placement = plan.placements[at(index)];
  return {{tensors + plan.blocks[at(placement.block)].offset_bytes + placement.offset_bytes,
           t.shape.elements_count() * bytes_per_element(t.type)},
          t.type,
          t.shape,
          t.scale(),
          t.zero_point()};
}

}  // namespace

rt::Result<std::size_t> Network::bytes_needed(const Model& model) {
  auto plan = plan_network(model);
  if (!plan) return plan.error();
  if (plan->tensor_bytes > kTensorBytesMax)
    return rt::Error{rt::ExitCode::bad_input, model.file + ": its tensors need more than 1 GB"};
  if (auto started = initialize_xnnpack(); !started) return started.error();
  const Counts counts = count(model, *plan);
  const std::size_t tensor_bytes = rt::bytes_of<std::byte>(plan->tensor_bytes);
  std::vector<Step> steps(counts.steps);
  std::vector<ByteTable> tables(counts.tables);
  for (std::size_t pool_bytes = kPoolBytesFirst;; pool_bytes *= 8) {
    // Left uninitialised: only what XNNPACK writes is ever backed by memory.
    const std::unique_ptr<std::byte[], void (*)(std::byte*)> borrowed(
        static_cast<std::byte*>(
            ::operator new (tensor_bytes + pool_bytes, std::align_val_t{rt::kCacheLineBytes}, std::nothrow)),
        [](std::byte* p) { ::operator delete (p, std::align_val_t{rt::kCacheLineBytes}); });
    if (borrowed == nullptr)
      return rt::Error{rt::ExitCode::failed, model.file + ": no memory to find out what the network needs"};
    XnnPool pool({borrowed.get() + tensor_bytes, pool_bytes});
    const XnnPoolScope scope(pool);
    auto built = Builder(model, *plan, borrowed.get(), steps, tables).build();
    if (built) return fixed_bytes(*plan, counts) + rt::round_up(pool.bytes_high_water(), rt::kCacheLineBytes);
    if (pool.refusals_count() == 0) return built.error();
    if (pool_bytes >= kPoolBytesMax)
      return rt::Error{rt::ExitCode::bad_input, model.file + ": XNNPACK needs more than 256 MB for it"};
  }
}

rt::Result<Network> Network::bind(const Model& model, rt::Slice memory) {
  auto plan = plan_network(model);
  if (!plan) return plan.error();
  const Counts counts = count(model, *plan);
  if (fixed_bytes(*plan, counts) > memory.bytes_left())
    return rt::Error{rt::ExitCode::bad_usage,
                     model.file + ": its tensors need " + std::to_string(fixed_bytes(*plan, counts)) +
                         " bytes, " + std::to_string(memory.bytes_left()) + " are planned for the network"};
  if (auto started = initialize_xnnpack(); !started) return started.error();
  Network network;
  std::span<Step> steps = memory.take<Step>(counts.steps);
  const std::span<ByteTable> tables = memory.take<ByteTable>(counts.tables);
  std::byte* tensors = memory.take<std::byte>(plan->tensor_bytes).data();
  XnnPool pool(memory.take<std::byte>(memory.bytes_left() / rt::kCacheLineBytes * rt::kCacheLineBytes));
  const XnnPoolScope scope(pool);
  Builder builder(model, *plan, tensors, steps, tables);
  if (auto built = builder.build(); !built) return built.error();
  network.steps_ = steps.first(builder.steps_count());
  network.input_ = view(model, *plan, tensors, plan->input);
  network.scores_ = view(model, *plan, tensors, plan->scores);
  network.score_rows_ = plan->score_rows;
  network.score_columns_ = plan->score_columns;
  network.use_ = {plan->tensor_bytes, pool.bytes_high_water(),
                  rt::bytes_of<Step>(counts.steps) + rt::bytes_of<ByteTable>(counts.tables),
                  plan->operators.size(), plan->operators_cut_count};
  return network;
}

rt::Status Network::invoke() noexcept {
  for (const Step& step : steps_) {
    switch (step.kind) {
      case Step::Kind::xnn:
        if (xnn_run_operator(step.op, nullptr) != xnn_status_success) return rt::Status::corrupt;
        break;
      case Step::Kind::table:
        map_bytes(*step.table, step.input, step.output, step.pixels_count, step.bytes_per_pixel);
        break;
      case Step::Kind::copy:
        copy_pixels(step.input, step.output, step.pixels_count, step.bytes_per_pixel);
        break;
      case Step::Kind::average_pool:
        average_pool(step.pool, step.input, step.output);
        break;
      case Step::Kind::pad:
        pad(step.pool.geometry.input, step.pool.geometry.output, step.pool.geometry.margins,
            std::span(step.fill).first(step.fill_bytes), step.input, step.output);
        break;
    }
  }
  return rt::Status::ok;
}

}  // namespace tactus::segment
