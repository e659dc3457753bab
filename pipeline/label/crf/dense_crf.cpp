#include "pipeline/label/crf/dense_crf.hpp"

#include <algorithm>
#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/label/crf/dense_crf.cpp"
#include "hwy/foreach_target.h"
// clang-format off
#include "hwy/highway.h"
// clang-format on
#include "rt/assert.hpp"

#ifndef TACTUS_LABEL_CRF_PASS
#define TACTUS_LABEL_CRF_PASS  // this file is compiled once per instruction set
namespace tactus::label {

/// One walk over the points: slice the blurred lattices, softmax, splat into the next lattices.
struct CrfPass {
  struct Kernel {
    const VertexWeight* simplices;
    std::size_t per_point;
    const float* slice_scale;
    const float* from;
    float* to;
  };
  std::array<Kernel, kCrfKernelsMax> kernel;
  std::size_t kernels_count, points_count;
  const float* unary;
  const float* multiplicity;
  const float* cost;  // null: Potts
  float* marginals;
  bool has_from, has_to;
  float change_max;
};

}  // namespace tactus::label
#endif

HWY_BEFORE_NAMESPACE();
namespace tactus::label::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// exp(x) for x <= 0 made of + and *: ln 2 in two parts, Taylor to degree 7 (relative error below 2e-7), 0
// from -87 on.
template <class D>
hn::Vec<D> Exponential(D df, hn::Vec<D> x) {
  const hn::RebindToSigned<D> di;
  const auto set = [&](float v) { return hn::Set(df, v); };
  const auto is_normal = hn::Gt(x, set(-87.0F));
  x = hn::Max(x, set(-87.0F));
  const auto n = hn::ConvertTo(di, hn::Sub(hn::Mul(x, set(1.44269504F)), set(0.5F)));
  const auto k = hn::ConvertTo(df, n);
  const auto r = hn::Sub(hn::Sub(x, hn::Mul(k, set(0.693359375F))), hn::Mul(k, set(-2.12194440e-4F)));
  auto p = set(1.0F / 5040.0F);
  for (const float c : {1.0F / 720.0F, 1.0F / 120.0F, 1.0F / 24.0F, 1.0F / 6.0F, 0.5F, 1.0F, 1.0F})
    p = hn::Add(hn::Mul(p, r), set(c));
  const auto power = hn::BitCast(df, hn::ShiftLeft<23>(hn::Add(n, hn::Set(di, 127))));
  return hn::IfThenElseZero(is_normal, hn::Mul(p, power));
}

template <std::size_t kColumns>
using Tag = hn::CappedTag<float, kColumns == 16 ? 16 : 8>;

template <std::size_t kColumns>
void Pass(CrfPass& pass) {
  const Tag<kColumns> df;
  constexpr std::size_t kLanes = hn::MaxLanes(Tag<kColumns>());
  constexpr std::size_t kVectors = kColumns / kLanes;
  using V = hn::Vec<Tag<kColumns>>;
  alignas(64) float exponentials[kColumns];
  auto change = hn::Zero(df);
  for (std::size_t i = 0; i < pass.points_count; ++i) {
    V x[kVectors];
    for (std::size_t c = 0; c < kVectors; ++c) x[c] = hn::Zero(df);
    if (pass.has_from) {
      for (std::size_t m = 0; m < pass.kernels_count; ++m) {
        const CrfPass::Kernel& kernel = pass.kernel[m];
        const VertexWeight* const simplex = kernel.simplices + i * kernel.per_point;
        V sum[kVectors];
        for (std::size_t c = 0; c < kVectors; ++c) sum[c] = hn::Zero(df);
        for (std::size_t k = 0; k < kernel.per_point; ++k) {
          const float* const from = kernel.from + std::size_t{simplex[k].vertex} * kColumns;
          const auto weight = hn::Set(df, simplex[k].weight);
          for (std::size_t c = 0; c < kVectors; ++c)
            sum[c] = hn::Add(sum[c], hn::Mul(weight, hn::Load(df, from + c * kLanes)));
        }
        const auto scale = hn::Set(df, kernel.slice_scale[i]);
        for (std::size_t c = 0; c < kVectors; ++c) x[c] = hn::Add(x[c], hn::Mul(scale, sum[c]));
      }
      if constexpr (kColumns == kCrfColumnsMax) {
        if (pass.cost != nullptr) {
          alignas(64) float messages[kColumns];
          for (std::size_t c = 0; c < kVectors; ++c) {
            hn::Store(x[c], df, messages + c * kLanes);
            x[c] = hn::Zero(df);
          }
          for (std::size_t l = 0; l < kMaterialCount; ++l) {
            const auto message = hn::Set(df, messages[l]);
            for (std::size_t c = 0; c < kVectors; ++c)
              x[c] = hn::Sub(x[c], hn::Mul(message, hn::Load(df, pass.cost + l * kColumns + c * kLanes)));
          }
        }
      }
    }
    const float* const unary = pass.unary + i * kColumns;
    auto most = hn::Set(df, -1e30F);
    for (std::size_t c = 0; c < kVectors; ++c) {
      x[c] = hn::Sub(x[c], hn::Load(df, unary + c * kLanes));
      most = hn::Max(most, x[c]);
    }
    most = hn::MaxOfLanes(df, most);
    for (std::size_t c = 0; c < kVectors; ++c) {
      x[c] = Exponential(df, hn::Sub(x[c], most));
      hn::Store(hn::Mul(x[c], hn::Load(df, pass.multiplicity + c * kLanes)), df, exponentials + c * kLanes);
    }
    float partial[8];
    for (std::size_t l = 0; l < 8; ++l) {
      partial[l] = exponentials[l];
      for (std::size_t c = 8; c < kColumns; c += 8) partial[l] += exponentials[l + c];
    }
    const float total = ((partial[0] + partial[4]) + (partial[2] + partial[6])) +
                        ((partial[1] + partial[5]) + (partial[3] + partial[7]));
    const auto inverse = hn::Set(df, 1.0F / total);
    float* const marginals = pass.marginals + i * kColumns;
    for (std::size_t c = 0; c < kVectors; ++c) {
      x[c] = hn::Mul(x[c], inverse);
      change = hn::Max(change, hn::Abs(hn::Sub(x[c], hn::Load(df, marginals + c * kLanes))));
      hn::Store(x[c], df, marginals + c * kLanes);
    }
    if (!pass.has_to) continue;
    for (std::size_t m = 0; m < pass.kernels_count; ++m) {
      const CrfPass::Kernel& kernel = pass.kernel[m];
      const VertexWeight* const simplex = kernel.simplices + i * kernel.per_point;
      for (std::size_t k = 0; k < kernel.per_point; ++k) {
        float* const to = kernel.to + std::size_t{simplex[k].vertex} * kColumns;
        const auto weight = hn::Set(df, simplex[k].weight);
        for (std::size_t c = 0; c < kVectors; ++c)
          hn::Store(hn::Add(hn::Load(df, to + c * kLanes), hn::Mul(weight, x[c])), df, to + c * kLanes);
      }
    }
  }
  pass.change_max = hn::GetLane(hn::MaxOfLanes(df, change));
}

template <std::size_t kColumns>
void Blur(const std::uint32_t* chain, std::size_t count, float* values) {
  const Tag<kColumns> df;
  constexpr std::size_t kLanes = hn::MaxLanes(Tag<kColumns>());
  constexpr std::size_t kVectors = kColumns / kLanes;
  using V = hn::Vec<Tag<kColumns>>;
  const auto half = hn::Set(df, 0.5F);
  for (std::size_t k = 0; k < count;) {
    V before[kVectors], here[kVectors];
    for (std::size_t c = 0; c < kVectors; ++c) {
      before[c] = hn::Zero(df);
      here[c] = hn::Load(df, values + std::size_t{chain[k] & ~kChainEnd} * kColumns + c * kLanes);
    }
    for (bool is_last = false; !is_last; ++k) {
      is_last = (chain[k] & kChainEnd) != 0;
      float* const at = values + std::size_t{chain[k] & ~kChainEnd} * kColumns;
      for (std::size_t c = 0; c < kVectors; ++c) {
        const auto after =
            is_last ? hn::Zero(df)
                    : hn::Load(df, values + std::size_t{chain[k + 1] & ~kChainEnd} * kColumns + c * kLanes);
        hn::Store(hn::Add(here[c], hn::Mul(half, hn::Add(before[c], after))), df, at + c * kLanes);
        before[c] = here[c];
        here[c] = after;
      }
    }
  }
}

void RunPass(CrfPass& pass, std::size_t columns) {
  if (columns == 8) return Pass<8>(pass);
  if (columns == 16) return Pass<16>(pass);
  return Pass<24>(pass);
}

void RunBlur(const Lattice& lattice, std::size_t columns, float* values) {
  for (int axis = 0; axis <= lattice.dimensions(); ++axis) {
    const auto chain = lattice.chains(axis);
    if (columns == 8)
      Blur<8>(chain.data(), chain.size(), values);
    else if (columns == 16)
      Blur<16>(chain.data(), chain.size(), values);
    else
      Blur<24>(chain.data(), chain.size(), values);
  }
}

}  // namespace tactus::label::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tactus::label {
HWY_EXPORT(RunPass);
HWY_EXPORT(RunBlur);

namespace {

constexpr float kPaddedCostNat = 1e20F;  // its exponential is 0
constexpr float kTinyDegree = 1e-20F;

std::size_t vertices_max_of(const DenseCrfConfig& config) {
  std::size_t most = 0;
  for (const auto& kernel : config.kernel) most = std::max(most, kernel.vertices_max);
  return most;
}

}  // namespace

std::size_t DenseCrf::bytes_needed(const DenseCrfConfig& config) {
  std::size_t bytes = LatticeHash::bytes_needed(vertices_max_of(config)) +
                      rt::bytes_of<std::uint32_t>(vertices_max_of(config)) +
                      rt::bytes_of<float>(config.points_max * kLatticeDimensionsMax) +
                      2 * rt::bytes_of<float>(config.points_max * kCrfColumnsMax);
  for (const auto& kernel : config.kernel)
    if (kernel.dimensions != 0)
      bytes += Lattice::bytes_needed(kernel.dimensions, config.points_max, kernel.vertices_max) +
               rt::bytes_of<float>(config.points_max) +
               2 * rt::bytes_of<float>(kernel.vertices_max * kCrfColumnsMax);
  return bytes;
}

void DenseCrf::bind(rt::Slice& memory, const DenseCrfConfig& config) {
  config_ = config;
  hash_.bind(memory, vertices_max_of(config));
  next_ = memory.take<std::uint32_t>(vertices_max_of(config));
  features_ = memory.take<float>(config.points_max * kLatticeDimensionsMax);
  unary_ = memory.take<float>(config.points_max * kCrfColumnsMax);
  marginals_ = memory.take<float>(config.points_max * kCrfColumnsMax);
  for (std::size_t m = 0; m < kCrfKernelsMax; ++m) {
    const auto& wanted = config.kernel[m];
    if (wanted.dimensions == 0) continue;
    kernel_[m].lattice.bind(memory, wanted.dimensions, config.points_max, wanted.vertices_max);
    kernel_[m].slice_scale = memory.take<float>(config.points_max);
    kernel_[m].values = memory.take<float>(wanted.vertices_max * kCrfColumnsMax);
    kernel_[m].scratch = memory.take<float>(wanted.vertices_max * kCrfColumnsMax);
  }
}

rt::Status DenseCrf::begin(std::size_t points_count) noexcept {
  points_count_ = 0;
  for (Kernel& kernel : kernel_) kernel.is_used = false;
  if (points_count > config_.points_max) return rt::Status::full;
  points_count_ = points_count;
  return rt::Status::ok;
}

rt::Status DenseCrf::add_kernel(std::size_t m, float weight, std::span<const float> features,
                                CrfNormalisation normalisation) noexcept {
  TACTUS_ASSERT(m < kCrfKernelsMax && config_.kernel[m].dimensions != 0);
  TACTUS_ASSERT(features.size() == points_count_ * static_cast<std::size_t>(config_.kernel[m].dimensions));
  Kernel& kernel = kernel_[m];
  kernel.is_used = false;
  if (weight == 0 || points_count_ == 0) return rt::Status::ok;
  const rt::Status built = kernel.lattice.build(features, hash_, next_);
  if (built != rt::Status::ok) return built;
  // Degrees: the filter of ones.
  const auto ones = marginals_.first(points_count_);
  std::fill(ones.begin(), ones.end(), 1.0F);
  lattice_filter(kernel.lattice, ones, kernel.values, kernel.slice_scale.first(points_count_));
  const std::size_t per_point = kernel.lattice.per_point();
  const auto simplices = kernel.lattice.simplices();
  for (std::size_t i = 0; i < points_count_; ++i) {
    const float degree = std::max(kernel.slice_scale[i], kTinyDegree);
    if (normalisation == CrfNormalisation::per_point) {
      kernel.slice_scale[i] = weight / degree;
      continue;
    }
    const float scale = std::sqrt(weight / degree);  // once when splatting, once when slicing
    kernel.slice_scale[i] = 1;
    for (VertexWeight& v : simplices.subspan(i * per_point, per_point)) v.weight *= scale;
  }
  kernel.is_used = true;
  return rt::Status::ok;
}

void DenseCrf::begin_columns(const CrfCompatibility& compatibility) noexcept {
  is_potts_ = compatibility.is_potts;
  if (is_potts_) {
    column_of_.fill(0);
    columns_count_ = points_count_ == 0 ? 0 : 1;
    return;
  }
  columns_count_ = kMaterialCount;
  for (std::size_t l = 0; l < kMaterialCount; ++l) {
    column_of_[l] = static_cast<std::uint8_t>(l);
    for (std::size_t k = 0; k < kMaterialCount; ++k) cost_[l * kCrfColumnsMax + k] = compatibility.of(l, k);
  }
}

// Materials that share a column so far and differ here part: each goes with the first that has its cost.
void DenseCrf::split_columns(const float* cost_nat) noexcept {
  std::array<float, kMaterialCount> first{};
  std::array<bool, kMaterialCount> is_seen{};
  bool is_split = false;
  for (std::size_t l = 0; l < kMaterialCount; ++l) {
    const std::size_t column = column_of_[l];
    if (!is_seen[column]) {
      is_seen[column] = true;
      first[column] = cost_nat[l];
    } else {
      is_split = is_split || first[column] != cost_nat[l];
    }
  }
  if (!is_split) return;
  std::array<std::uint8_t, kMaterialCount> refined{};
  columns_count_ = 0;
  for (std::size_t l = 0; l < kMaterialCount; ++l) {
    std::size_t k = 0;
    while (column_of_[k] != column_of_[l] || cost_nat[k] != cost_nat[l]) ++k;
    refined[l] = k == l ? static_cast<std::uint8_t>(columns_count_++) : refined[k];
  }
  column_of_ = refined;
}

void DenseCrf::end_columns() noexcept {
  columns_padded_ = (std::max<std::size_t>(columns_count_, 1) + 7) / 8 * 8;
  multiplicity_.fill(0);
  for (const std::uint8_t column : column_of_) multiplicity_[column] += 1;
}

void DenseCrf::load_unary(std::size_t point, const float* cost_nat) noexcept {
  const auto unary = unary_.subspan(point * columns_padded_, columns_padded_);
  std::fill(unary.begin(), unary.end(), kPaddedCostNat);
  for (std::size_t l = 0; l < kMaterialCount; ++l) unary[column_of_[l]] = cost_nat[l];
}

CrfReport DenseCrf::solve(int iterations_max, float settled_change) noexcept {
  CrfReport report;
  CrfPass pass{};
  pass.points_count = points_count_;
  pass.unary = unary_.data();
  pass.multiplicity = multiplicity_.data();
  pass.cost = is_potts_ ? nullptr : cost_.data();
  pass.marginals = marginals_.data();
  std::array<Kernel*, kCrfKernelsMax> used{};
  for (Kernel& kernel : kernel_)
    if (kernel.is_used) used[pass.kernels_count++] = &kernel;
  const auto walk = [&](bool has_from, bool has_to) {
    for (std::size_t m = 0; m < pass.kernels_count; ++m) {
      Kernel& kernel = *used[m];
      if (has_to)
        std::fill_n(kernel.scratch.begin(), std::size_t{kernel.lattice.vertices_count()} * columns_padded_,
                    0.0F);
      pass.kernel[m] = {kernel.lattice.simplices().data(), kernel.lattice.per_point(),
                        kernel.slice_scale.data(), kernel.values.data(), kernel.scratch.data()};
    }
    pass.has_from = has_from;
    pass.has_to = has_to;
    HWY_DYNAMIC_DISPATCH(RunPass)(pass, columns_padded_);
  };
  walk(false, iterations_max > 0);
  while (report.iterations < iterations_max) {
    for (std::size_t m = 0; m < pass.kernels_count; ++m) {
      std::swap(used[m]->values, used[m]->scratch);
      HWY_DYNAMIC_DISPATCH(RunBlur)(used[m]->lattice, columns_padded_, used[m]->values.data());
    }
    ++report.iterations;
    walk(true, report.iterations < iterations_max);
    report.change_max = pass.change_max;
    if (pass.change_max < settled_change) break;
  }
  return report;
}

void DenseCrf::marginals_of(std::size_t point, std::span<float, kMaterialCount> marginals) const noexcept {
  const auto from = marginals_.subspan(point * columns_padded_, columns_padded_);
  for (std::size_t l = 0; l < kMaterialCount; ++l) marginals[l] = from[column_of_[l]];
}

}  // namespace tactus::label
#endif
