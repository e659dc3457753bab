// A slow, plain interpreter of the operators in the network's 8-bit and float subset, written from the public
// description of the format: the oracle for Network. One loop nest per operator, no cleverness, every tensor
// dense.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <vector>

#include "pipeline/segment/tflite_model.hpp"

namespace tactus::segment::test {

/// How an int32 sum becomes 8 bits: as TensorFlow Lite's reference kernels do (a 31-bit multiplier, rounded
/// twice), or as XNNPACK's fp32 kernels do (one float product, rounded to nearest even).
enum class Rounding { reference, xnnpack };

class ReferenceInterpreter {
 public:
  ReferenceInterpreter(const Model& model, Rounding rounding) : model_(model), rounding_(rounding) {
    values_.resize(model.tensors.size());
    for (std::size_t i = 0; i < model.tensors.size(); ++i) {
      const Tensor& t = model.tensors[i];
      if (!t.is_constant()) continue;
      for (std::size_t k = 0; k < t.shape.elements_count(); ++k) values_[i].push_back(element(t, k));
    }
  }

  /// Elements as doubles: quantised numbers for 8 bits and int32, real ones for float32.
  std::vector<double>& tensor(std::int32_t index) { return values_[static_cast<std::size_t>(index)]; }

  /// Runs operators [0, end).
  void run(std::size_t end) {
    for (std::size_t i = 0; i < end && i < model_.operators.size(); ++i) run_operator(model_.operators[i]);
  }

  void run_operator(const Operator& op) {
    in_ = &model_.tensors[static_cast<std::size_t>(op.inputs[0])];
    out_ = &model_.tensors[static_cast<std::size_t>(op.outputs[0])];
    const std::vector<double>& x = tensor(op.inputs[0]);
    std::vector<double>& y = tensor(op.outputs[0]);
    y.assign(out_->shape.elements_count(), 0);
    low_ = out_->type == ElementType::int8 ? -128 : 0;
    high_ = out_->type == ElementType::int8 ? 127 : 255;
    if (op.activation != Activation::none || op.kind == OperatorKind::relu || op.kind == OperatorKind::relu6)
      low_ = std::max<double>(low_, out_->zero_point());
    if (op.activation == Activation::relu6 || op.kind == OperatorKind::relu6)
      high_ = std::min(high_, out_->zero_point() + std::round(6.0 / static_cast<double>(out_->scale())));
    if (out_->type == ElementType::float32) {
      low_ = op.activation == Activation::none ? -std::numeric_limits<double>::infinity() : 0;
      high_ = op.activation == Activation::relu6 ? 6 : std::numeric_limits<double>::infinity();
      if (op.kind == OperatorKind::relu || op.kind == OperatorKind::relu6) low_ = 0;
      if (op.kind == OperatorKind::relu6) high_ = 6;
    }
    switch (op.kind) {
      case OperatorKind::conv:
      case OperatorKind::depthwise_conv:
      case OperatorKind::fully_connected:
        return conv(op, x, y);
      case OperatorKind::add:
      case OperatorKind::mul:
        return binary(op, x, y);
      case OperatorKind::average_pool:
      case OperatorKind::max_pool:
      case OperatorKind::mean:
        return pool(op, x, y);
      case OperatorKind::resize_bilinear:
        return resize(op, x, y);
      case OperatorKind::concatenation:
        return concatenate(op, y);
      case OperatorKind::pad:
        return pad(op, x, y);
      case OperatorKind::reshape:
        y = x;
        return;
      case OperatorKind::relu:
      case OperatorKind::relu6:
      case OperatorKind::logistic:
      case OperatorKind::hard_swish:
      case OperatorKind::quantize:
        return unary(op, x, y);
      default:
        throw std::runtime_error(std::string("reference interpreter: ") + name(op.kind));
    }
  }

 private:
  static double element(const Tensor& t, std::size_t k) {
    const std::byte* p = t.constant.data() + k * bytes_per_element(t.type);
    if (t.type == ElementType::int8) return static_cast<double>(static_cast<std::int8_t>(*p));
    if (t.type == ElementType::uint8) return static_cast<double>(static_cast<std::uint8_t>(*p));
    if (t.type == ElementType::int32) {
      std::int32_t v = 0;
      std::memcpy(&v, p, 4);
      return v;
    }
    float v = 0;
    std::memcpy(&v, p, 4);
    return static_cast<double>(v);
  }

  static std::size_t at(const Shape& s, int y, int x, int c) {
    return (static_cast<std::size_t>(y) * static_cast<std::size_t>(s.width()) + static_cast<std::size_t>(x)) *
               static_cast<std::size_t>(s.channels()) +
           static_cast<std::size_t>(c);
  }

  double clamp(double v) const { return std::clamp(v, low_, high_); }

  static double half_away(double v) { return v < 0 ? -std::floor(-v + 0.5) : std::floor(v + 0.5); }

  /// gemmlowp: saturating rounding doubling high multiply, then a rounding shift.
  static std::int32_t multiply_twice_rounded(std::int64_t x, double real) {
    int shift = 0;
    const double fraction = std::frexp(real, &shift);
    auto q = static_cast<std::int64_t>(std::llround(fraction * 2147483648.0));
    if (q == std::int64_t{1} << 31) {
      q /= 2;
      ++shift;
    }
    if (shift < -31) return 0;
    const std::int64_t a = shift > 0 ? x << shift : x;
    const std::int64_t ab = a * q;
    const std::int64_t high = (ab + (ab >= 0 ? 1LL << 30 : 1 - (1LL << 30))) / (1LL << 31);
    const int right = shift < 0 ? -shift : 0;
    const std::int64_t mask = (1LL << right) - 1;
    return static_cast<std::int32_t>((high >> right) +
                                     ((high & mask) > (mask >> 1) + (high < 0 ? 1 : 0) ? 1 : 0));
  }

  double requantize(std::int64_t sum, float in_scale, float filter_scale) const {
    const float out_scale = out_->scale();
    if (rounding_ == Rounding::reference) {
      const double real =
          static_cast<double>(in_scale) * static_cast<double>(filter_scale) / static_cast<double>(out_scale);
      return clamp(static_cast<double>(multiply_twice_rounded(sum, real)) + out_->zero_point());
    }
    const float scale = in_scale * filter_scale / out_scale;
    const float scaled = static_cast<float>(static_cast<std::int32_t>(sum)) * scale;
    const float limited = std::clamp(scaled, static_cast<float>(low_ - out_->zero_point()),
                                     static_cast<float>(high_ - out_->zero_point()));
    return static_cast<double>(std::nearbyintf(limited)) + out_->zero_point();
  }

  void conv(const Operator& op, const std::vector<double>& x, std::vector<double>& y) {
    const Tensor& filter = model_.tensors[static_cast<std::size_t>(op.inputs[1])];
    const std::vector<double>& w = tensor(op.inputs[1]);
    const std::vector<double>* bias =
        op.inputs.size() > 2 && op.inputs[2] >= 0 ? &tensor(op.inputs[2]) : nullptr;
    const bool depthwise = op.kind == OperatorKind::depthwise_conv;
    Shape in = in_->shape, out = out_->shape;
    if (op.kind == OperatorKind::fully_connected) {
      in.dims = {1, 1, 1, static_cast<std::int32_t>(x.size())};
      out.dims = {1, 1, 1, static_cast<std::int32_t>(y.size())};
    }
    const Margins m = op.kind == OperatorKind::fully_connected ? Margins{} : margins_of(op, in, out);
    const int per_group = depthwise ? out.channels() / in.channels() : out.channels();
    const double in_zero = in_->zero_point(), filter_zero = filter.zero_point();
    // The inner loop on int32 rows: an image of 512 x 512 through 2 GMAC has to end within the test's time.
    std::vector<std::int32_t> xi(x.size()), wi(w.size());
    const bool integer = in_->type != ElementType::float32;
    if (integer) {
      for (std::size_t i = 0; i < x.size(); ++i) xi[i] = static_cast<std::int32_t>(x[i] - in_zero);
      for (std::size_t i = 0; i < w.size(); ++i) wi[i] = static_cast<std::int32_t>(w[i] - filter_zero);
    }
    for (int oy = 0; oy < out.height(); ++oy)
      for (int ox = 0; ox < out.width(); ++ox)
        for (int oc = 0; oc < out.channels(); ++oc) {
          double sum = 0;
          std::int32_t isum = 0;
          for (int ky = 0; ky < op.window_h; ++ky)
            for (int kx = 0; kx < op.window_w; ++kx) {
              const int iy = oy * op.stride_h - m.top + ky * op.dilation_h;
              const int ix = ox * op.stride_w - m.left + kx * op.dilation_w;
              if (iy < 0 || ix < 0 || iy >= in.height() || ix >= in.width()) continue;
              const int first = depthwise ? oc / per_group : 0, count = depthwise ? 1 : in.channels();
              const std::size_t xo = at(in, iy, ix, first);
              const std::size_t wo =
                  depthwise ? at(filter.shape, ky, kx, oc)
                            : ((static_cast<std::size_t>(oc) * static_cast<std::size_t>(op.window_h) +
                                static_cast<std::size_t>(ky)) *
                                   static_cast<std::size_t>(op.window_w) +
                               static_cast<std::size_t>(kx)) *
                                  static_cast<std::size_t>(in.channels());
              for (int c = 0; c < count; ++c) {
                const std::size_t k = static_cast<std::size_t>(c);
                if (integer)
                  isum += xi[xo + k] * wi[wo + k];
                else
                  sum += x[xo + k] * w[wo + k];
              }
            }
          const std::size_t k = static_cast<std::size_t>(oc);
          if (integer) {
            const std::int64_t total = isum + (bias != nullptr ? static_cast<std::int64_t>((*bias)[k]) : 0);
            const std::vector<float>& scales = filter.quantization.scales;
            y[at(out, oy, ox, oc)] =
                requantize(total, in_->scale(), scales.size() == 1 ? scales[0] : scales[k]);
          } else {
            y[at(out, oy, ox, oc)] = clamp(sum + (bias != nullptr ? (*bias)[k] : 0));
          }
        }
  }

  void binary(const Operator& op, const std::vector<double>& x, std::vector<double>& y) {
    const Tensor& second = model_.tensors[static_cast<std::size_t>(op.inputs[1])];
    const std::vector<double>& z = tensor(op.inputs[1]);
    const auto pick = [](const Shape& s, int oy, int ox, int c) {
      return at(s, std::min(oy, s.height() - 1), std::min(ox, s.width() - 1), std::min(c, s.channels() - 1));
    };
    const double sa = static_cast<double>(in_->scale()), sb = static_cast<double>(second.scale()),
                 so = static_cast<double>(out_->scale());
    for (int oy = 0; oy < out_->shape.height(); ++oy)
      for (int ox = 0; ox < out_->shape.width(); ++ox)
        for (int c = 0; c < out_->shape.channels(); ++c) {
          const double a = x[pick(in_->shape, oy, ox, c)], b = z[pick(second.shape, oy, ox, c)];
          double& o = y[at(out_->shape, oy, ox, c)];
          const bool is_add = op.kind == OperatorKind::add;
          if (out_->type == ElementType::float32) {
            o = clamp(is_add ? a + b : a * b);
          } else if (is_add && rounding_ == Rounding::reference) {
            const double twice = 2 * std::max(sa, sb);
            const auto av = static_cast<std::int64_t>(a - in_->zero_point()) * (1 << 20);
            const auto bv = static_cast<std::int64_t>(b - second.zero_point()) * (1 << 20);
            const std::int32_t sum =
                multiply_twice_rounded(av, sa / twice) + multiply_twice_rounded(bv, sb / twice);
            o = clamp(multiply_twice_rounded(sum, twice / ((1 << 20) * so)) + out_->zero_point());
          } else {
            const double av = (a - in_->zero_point()) * sa, bv = (b - second.zero_point()) * sb;
            o = clamp(half_away((is_add ? av + bv : av * bv) / so) + out_->zero_point());
          }
        }
  }

  void pool(const Operator& op, const std::vector<double>& x, std::vector<double>& y) {
    const bool is_mean = op.kind == OperatorKind::mean;
    const Margins m = is_mean ? Margins{} : margins_of(op, in_->shape, out_->shape);
    const int wh = is_mean ? in_->shape.height() : op.window_h,
              ww = is_mean ? in_->shape.width() : op.window_w;
    Shape out = out_->shape;
    if (is_mean) out.dims = {1, 1, 1, in_->shape.channels()};
    for (int oy = 0; oy < out.height(); ++oy)
      for (int ox = 0; ox < out.width(); ++ox)
        for (int c = 0; c < out.channels(); ++c) {
          double sum = 0, most = -std::numeric_limits<double>::infinity();
          int count = 0;
          for (int ky = 0; ky < wh; ++ky)
            for (int kx = 0; kx < ww; ++kx) {
              const int iy = oy * op.stride_h - m.top + ky, ix = ox * op.stride_w - m.left + kx;
              if (iy < 0 || ix < 0 || iy >= in_->shape.height() || ix >= in_->shape.width()) continue;
              const double v = x[at(in_->shape, iy, ix, c)];
              sum += v;
              most = std::max(most, v);
              ++count;
            }
          double result = op.kind == OperatorKind::max_pool ? most : sum / count;
          if (out_->type != ElementType::float32 && op.kind == OperatorKind::average_pool)
            result = half_away(result);
          if (out_->type != ElementType::float32 && is_mean)
            result = half_away((sum / count - in_->zero_point()) * static_cast<double>(in_->scale()) /
                               static_cast<double>(out_->scale())) +
                     out_->zero_point();
          y[at(out, oy, ox, c)] = clamp(result);
        }
  }

  void resize(const Operator& op, const std::vector<double>& x, std::vector<double>& y) {
    const Shape& in = in_->shape;
    const Shape& out = out_->shape;
    const auto source = [&](int o, int in_length, int out_length) {
      if (op.align_corners && out_length > 1)
        return static_cast<double>(o) * (in_length - 1) / (out_length - 1);
      const double ratio = static_cast<double>(in_length) / out_length;
      return op.half_pixel_centers ? std::max((o + 0.5) * ratio - 0.5, 0.0) : o * ratio;
    };
    for (int oy = 0; oy < out.height(); ++oy)
      for (int ox = 0; ox < out.width(); ++ox) {
        const double sy = source(oy, in.height(), out.height()), sx = source(ox, in.width(), out.width());
        const int y0 = std::min(static_cast<int>(sy), in.height() - 1),
                  x0 = std::min(static_cast<int>(sx), in.width() - 1);
        const int y1 = std::min(y0 + 1, in.height() - 1), x1 = std::min(x0 + 1, in.width() - 1);
        const double fy = sy - y0, fx = sx - x0;
        for (int c = 0; c < out.channels(); ++c) {
          const double v = (1 - fy) * ((1 - fx) * x[at(in, y0, x0, c)] + fx * x[at(in, y0, x1, c)]) +
                           fy * ((1 - fx) * x[at(in, y1, x0, c)] + fx * x[at(in, y1, x1, c)]);
          double& o = y[at(out, oy, ox, c)];
          if (out_->type == ElementType::float32)
            o = v;
          else
            o = rounding_ == Rounding::reference ? half_away(v) : std::floor(v + 0.5);
        }
      }
  }

  void concatenate(const Operator& op, std::vector<double>& y) {
    int before = 0;
    for (const std::int32_t part : op.inputs) {
      const Tensor& t = model_.tensors[static_cast<std::size_t>(part)];
      const std::vector<double>& x = tensor(part);
      for (int oy = 0; oy < t.shape.height(); ++oy)
        for (int ox = 0; ox < t.shape.width(); ++ox)
          for (int c = 0; c < t.shape.channels(); ++c) {
            const double v = x[at(t.shape, oy, ox, c)];
            double& o = y[at(out_->shape, oy, ox, before + c)];
            if (t.type == ElementType::float32 ||
                (t.scale() == out_->scale() && t.zero_point() == out_->zero_point()))
              o = v;
            else
              o = clamp(multiply_twice_rounded(
                            static_cast<std::int64_t>(v - t.zero_point()),
                            static_cast<double>(t.scale()) / static_cast<double>(out_->scale())) +
                        out_->zero_point());
          }
      before += t.shape.channels();
    }
  }

  void pad(const Operator& op, const std::vector<double>& x, std::vector<double>& y) {
    const std::vector<double>& m = tensor(op.inputs[1]);
    std::fill(y.begin(), y.end(), in_->type == ElementType::float32 ? 0.0 : in_->zero_point());
    for (int iy = 0; iy < in_->shape.height(); ++iy)
      for (int ix = 0; ix < in_->shape.width(); ++ix)
        for (int c = 0; c < in_->shape.channels(); ++c)
          y[at(out_->shape, iy + static_cast<int>(m[2]), ix + static_cast<int>(m[4]), c)] =
              x[at(in_->shape, iy, ix, c)];
  }

  void unary(const Operator& op, const std::vector<double>& x, std::vector<double>& y) {
    const double si = static_cast<double>(in_->scale()), so = static_cast<double>(out_->scale());
    const auto real = [&](double v) {
      if (op.kind == OperatorKind::logistic) return 1 / (1 + std::exp(-v));
      if (op.kind == OperatorKind::hard_swish) return v * std::clamp(v + 3, 0.0, 6.0) / 6;
      return v;
    };
    for (std::size_t i = 0; i < x.size(); ++i) {
      if (out_->type == ElementType::float32)
        y[i] = clamp(real(x[i]));
      else if (op.kind == OperatorKind::logistic || op.kind == OperatorKind::hard_swish)
        y[i] = clamp(std::floor(real((x[i] - in_->zero_point()) * si) / so + 0.5) + out_->zero_point());
      else
        y[i] = clamp(multiply_twice_rounded(static_cast<std::int64_t>(x[i] - in_->zero_point()), si / so) +
                     out_->zero_point());
    }
  }

  const Model& model_;
  Rounding rounding_;
  std::vector<std::vector<double>> values_;
  const Tensor* in_ = nullptr;
  const Tensor* out_ = nullptr;
  double low_ = 0, high_ = 0;
};

}  // namespace tactus::segment::test
