#include "pipeline/label/crf/dense_crf.hpp"

#include <algorithm>
#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/label/crf/dense_crf.cpp"
#include "hwy/foreach_target.h"
// clang-format off
#include "hwy/highway.h"
#include "hwy/cache_control.h"
// clang-format on
#include "rt/assert.hpp"

#ifndef TACTUS_LABEL_CRF_PASS
#define TACTUS_LABEL_CRF_PASS  // this file is compiled once per instruction set
namespace tactus::label {

/// One walk over the points: slice the blurred lattices, softmax, splat into the next lattices.
struct CrfPass {
  struct Kernel {
    const CrfSimplexVertex* simplices;
    std::size_t per_point;
    const float* slice_scale;
    const std::int16_t* from;
    std::int16_t* to;
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

// Lanes of a vector: half a cache line of columns, or 8 when there are 8 or 24.
template <std::size_t kColumns>
using FixedTag = hn::CappedTag<std::int16_t, kColumns == 16 ? 16 : 8>;
template <std::size_t kColumns>
using FloatTag = hn::CappedTag<float, kColumns == 16 ? 16 : 8>;

template <std::size_t kColumns>
void Pass(CrfPass& pass) {
  const FloatTag<kColumns> df;
  const FixedTag<kColumns> dq;
  const hn::Rebind<std::int16_t, FloatTag<kColumns>>
      dh;  // as many 16-bit lanes as there are floats in a vector
  const hn::RebindToSigned<FloatTag<kColumns>> di;
  constexpr std::size_t kLanes = hn::MaxLanes(FloatTag<kColumns>()), kVectors = kColumns / kLanes;
  constexpr std::size_t kFixedLanes = hn::MaxLanes(FixedTag<kColumns>()),
                        kFixedVectors = kColumns / kFixedLanes;
  using V = hn::Vec<FloatTag<kColumns>>;
  using Q = hn::Vec<FixedTag<kColumns>>;
  alignas(64) float exponentials[kColumns];
  alignas(64) std::int16_t fixed[kColumns];
  auto change = hn::Zero(df);
  for (std::size_t i = 0; i < pass.points_count; ++i) {
    V x[kVectors];
    for (std::size_t c = 0; c < kVectors; ++c) x[c] = hn::Zero(df);
    if (pass.has_from) {
      for (std::size_t m = 0; m < pass.kernels_count; ++m) {
        const CrfPass::Kernel& kernel = pass.kernel[m];
        const CrfSimplexVertex* const simplex = kernel.simplices + i * kernel.per_point;
        Q sum[kFixedVectors];
        for (std::size_t c = 0; c < kFixedVectors; ++c) sum[c] = hn::Zero(dq);
        for (std::size_t k = 0; k < kernel.per_point; ++k) {
          const std::int16_t* const from =
              kernel.from + std::size_t{simplex[k].vertex & ~kFirstTouch} * kColumns;
          const auto share = hn::Set(dq, simplex[k].slice);
          for (std::size_t c = 0; c < kFixedVectors; ++c)
            sum[c] =
                hn::SaturatedAdd(sum[c], hn::MulFixedPoint15(share, hn::Load(dq, from + c * kFixedLanes)));
        }
        for (std::size_t c = 0; c < kFixedVectors; ++c) hn::Store(sum[c], dq, fixed + c * kFixedLanes);
        const auto scale = hn::Set(df, kernel.slice_scale[i]);
        for (std::size_t c = 0; c < kVectors; ++c)
          x[c] = hn::Add(
              x[c], hn::Mul(scale, hn::ConvertTo(df, hn::PromoteTo(di, hn::Load(dh, fixed + c * kLanes)))));
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
      const auto rounded =
          hn::ConvertTo(di, hn::Add(hn::Mul(x[c], hn::Set(df, 32767.0F)), hn::Set(df, 0.5F)));
      hn::Store(hn::DemoteTo(dh, rounded), dh, fixed + c * kLanes);
    }
    if (!pass.has_to) continue;
    Q q[kFixedVectors];
    for (std::size_t c = 0; c < kFixedVectors; ++c) q[c] = hn::Load(dq, fixed + c * kFixedLanes);
    for (std::size_t m = 0; m < pass.kernels_count; ++m) {
      const CrfPass::Kernel& kernel = pass.kernel[m];
      const CrfSimplexVertex* const simplex = kernel.simplices + i * kernel.per_point;
      for (std::size_t k = 0; k < kernel.per_point; ++k) {
        std::int16_t* const to = kernel.to + std::size_t{simplex[k].vertex & ~kFirstTouch} * kColumns;
        const auto share = hn::Set(dq, simplex[k].splat);
        const auto keep =
            hn::Set(dq, static_cast<std::int16_t>((simplex[k].vertex >> 31) - 1U));  // 0 or all ones
        for (std::size_t c = 0; c < kFixedVectors; ++c)
          hn::Store(hn::SaturatedAdd(hn::And(keep, hn::Load(dq, to + c * kFixedLanes)),
                                     hn::MulFixedPoint15(share, q[c])),
                    dq, to + c * kFixedLanes);
      }
    }
  }
  pass.change_max = hn::GetLane(hn::MaxOfLanes(df, change));
}

// Rows are short in 6 dimensions: a branch at their ends would be predicted wrongly every few vertices, so
// what lies beyond an end is loaded all the same and has no share.
template <std::size_t kColumns>
void Blur(const CrfChainVertex* chain, std::size_t count, std::int16_t* values) {
  const FixedTag<kColumns> dq;
  constexpr std::size_t kLanes = hn::MaxLanes(FixedTag<kColumns>()), kVectors = kColumns / kLanes;
  using Q = hn::Vec<FixedTag<kColumns>>;
  constexpr std::size_t kAhead = 32;
  if (count == 0) return;
  Q before[kVectors], here[kVectors];
  for (std::size_t c = 0; c < kVectors; ++c) {
    before[c] = hn::Zero(dq);
    here[c] = hn::Load(dq, values + std::size_t{chain[0].vertex} * kColumns + c * kLanes);
  }
  for (std::size_t k = 0; k < count; ++k) {
    std::int16_t* const at = values + std::size_t{chain[k].vertex} * kColumns;
    const std::int16_t* const from = values + std::size_t{chain[k + 1 < count ? k + 1 : k].vertex} * kColumns;
    hwy::Prefetch(values + std::size_t{chain[k + kAhead < count ? k + kAhead : k].vertex} * kColumns);
    const auto before_share = hn::Set(dq, chain[k].before), after_share = hn::Set(dq, chain[k].after);
    for (std::size_t c = 0; c < kVectors; ++c) {
      const auto after = hn::Load(dq, from + c * kLanes);
      const auto moved = hn::Add(hn::MulFixedPoint15(before_share, hn::Sub(before[c], here[c])),
                                 hn::MulFixedPoint15(after_share, hn::Sub(after, here[c])));
      hn::Store(hn::Add(here[c], moved), dq, at + c * kLanes);
      before[c] = here[c];
      here[c] = after;
    }
  }
}

void RunPass(CrfPass& pass, std::size_t columns) {
  if (columns == 8) return Pass<8>(pass);
  if (columns == 16) return Pass<16>(pass);
  return Pass<24>(pass);
}

void RunBlur(const CrfChainVertex* chain, std::size_t count, std::size_t columns, std::int16_t* values) {
  if (columns == 8) return Blur<8>(chain, count, values);
  if (columns == 16) return Blur<16>(chain, count, values);
  return Blur<24>(chain, count, values);
}

}  // namespace tactus::label::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tactus::label {
HWY_EXPORT(RunPass);
HWY_EXPORT(RunBlur);

namespace {

constexpr float kPaddedCostNat = 1e20F;  // its exponential is 0
constexpr float kTinyMass = 1e-20F;
constexpr float kOne = 32767;  // in 1/32768: what fits 16 bits and means 1

std::size_t vertices_max_of(const DenseCrfConfig& config) {
  std::size_t most = 0;
  for (const auto& kernel : config.kernel) most = std::max(most, kernel.vertices_max);
  return most;
}
int dimensions_max_of(const DenseCrfConfig& config) {
  int most = 0;
  for (const auto& kernel : config.kernel) most = std::max(most, kernel.dimensions);
  return most;
}
std::size_t per_point(int dimensions) { return static_cast<std::size_t>(dimensions) + 1; }

std::int16_t to_fixed(float share) { return static_cast<std::int16_t>(share * kOne + 0.5F); }

}  // namespace

std::size_t DenseCrf::bytes_needed(const DenseCrfConfig& config) {
  const std::size_t vertices_max = vertices_max_of(config);
  std::size_t bytes = LatticeHash::bytes_needed(vertices_max) +
                      Lattice::bytes_needed(dimensions_max_of(config), config.points_max, vertices_max) +
                      rt::bytes_of<std::uint32_t>(vertices_max) + rt::bytes_of<float>(vertices_max) +
                      rt::bytes_of<float>(config.points_max * kLatticeDimensionsMax) +
                      2 * rt::bytes_of<float>(config.points_max * kCrfColumnsMax);
  for (const auto& kernel : config.kernel)
    if (kernel.dimensions != 0)
      bytes += rt::bytes_of<CrfSimplexVertex>(config.points_max * per_point(kernel.dimensions)) +
               rt::bytes_of<CrfChainVertex>(kernel.vertices_max * per_point(kernel.dimensions)) +
               rt::bytes_of<float>(config.points_max) +
               2 * rt::bytes_of<std::int16_t>(kernel.vertices_max * kCrfColumnsMax);
  return bytes;
}

void DenseCrf::bind(rt::Slice& memory, const DenseCrfConfig& config) {
  config_ = config;
  const std::size_t vertices_max = vertices_max_of(config);
  hash_.bind(memory, vertices_max);
  lattice_.bind(memory, dimensions_max_of(config), config.points_max, vertices_max);
  next_ = memory.take<std::uint32_t>(vertices_max);
  mass_ = memory.take<float>(vertices_max);
  features_ = memory.take<float>(config.points_max * kLatticeDimensionsMax);
  unary_ = memory.take<float>(config.points_max * kCrfColumnsMax);
  marginals_ = memory.take<float>(config.points_max * kCrfColumnsMax);
  for (std::size_t m = 0; m < kCrfKernelsMax; ++m) {
    const auto& wanted = config.kernel[m];
    Kernel& kernel = kernel_[m];
    kernel.dimensions = wanted.dimensions;
    if (wanted.dimensions == 0) continue;
    kernel.simplices = memory.take<CrfSimplexVertex>(config.points_max * per_point(wanted.dimensions));
    kernel.chains = memory.take<CrfChainVertex>(wanted.vertices_max * per_point(wanted.dimensions));
    kernel.slice_scale = memory.take<float>(config.points_max);
    kernel.values = memory.take<std::int16_t>(wanted.vertices_max * kCrfColumnsMax);
    kernel.scratch = memory.take<std::int16_t>(wanted.vertices_max * kCrfColumnsMax);
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
  hash_.clear(config_.kernel[m].vertices_max);
  const rt::Status built = lattice_.build(kernel.dimensions, features, hash_, next_);
  if (built != rt::Status::ok) return built;
  quantise(kernel, weight, normalisation);
  kernel.is_used = true;
  return rt::Status::ok;
}

// Masses: of a vertex what all points put there, splat_scale each; blurred along one axis after the other,
// they give the neighbours' shares; sliced, they give the point's message its size.
void DenseCrf::quantise(Kernel& kernel, float weight, CrfNormalisation normalisation) noexcept {
  const std::size_t vertices = per_point(kernel.dimensions);
  const auto simplices = lattice_.simplices();
  const auto splat_scale = marginals_.first(points_count_);
  kernel.vertices_count = lattice_.vertices_count();
  std::fill(splat_scale.begin(), splat_scale.end(), 1.0F);
  if (normalisation == CrfNormalisation::symmetric) {
    const auto degree = unary_.first(points_count_);
    lattice_filter(lattice_, splat_scale, mass_, degree);
    for (std::size_t i = 0; i < points_count_; ++i)
      splat_scale[i] = 1 / std::sqrt(std::max(degree[i], kTinyMass));
  }
  const auto mass = mass_.first(kernel.vertices_count);
  std::fill(mass.begin(), mass.end(), 0.0F);
  for (std::size_t i = 0; i < points_count_; ++i)
    for (std::size_t k = 0; k < vertices; ++k) {
      const VertexWeight& v = simplices[i * vertices + k];
      mass[v.vertex] += v.weight * splat_scale[i];
    }
  std::fill_n(next_.begin(), kernel.vertices_count, kFirstTouch);
  for (std::size_t i = 0; i < points_count_; ++i)
    for (std::size_t k = 0; k < vertices; ++k) {
      const VertexWeight& v = simplices[i * vertices + k];
      const float share = v.weight * splat_scale[i] / std::max(mass[v.vertex], kTinyMass);
      kernel.simplices[i * vertices + k] = {v.vertex | next_[v.vertex], to_fixed(std::min(share, 1.0F)), 0};
      next_[v.vertex] = 0;
    }
  std::size_t length = 0;
  for (int axis = 0; axis <= kernel.dimensions; ++axis) {
    kernel.chain_begin[static_cast<std::size_t>(axis)] = length;
    float before = 0;
    const auto chain = lattice_.chains(axis);
    for (std::size_t k = 0; k < chain.size(); ++k) {
      const bool is_last = (chain[k] & kChainEnd) != 0;
      float& here = mass[chain[k] & ~kChainEnd];
      const float old = here, after = is_last ? 0 : mass[chain[k + 1] & ~kChainEnd];
      here = old + 0.5F * (before + after);
      const float inverse = 0.5F / std::max(here, kTinyMass);
      kernel.chains[length++] = {chain[k] & ~kChainEnd, to_fixed(before * inverse),
                                 to_fixed(after * inverse)};
      before = is_last ? 0 : old;
    }
  }
  kernel.chain_begin[vertices] = length;
  for (std::size_t i = 0; i < points_count_; ++i) {
    float message = 0;
    for (const VertexWeight& v : simplices.subspan(i * vertices, vertices))
      message += v.weight * mass[v.vertex];
    const float inverse = 1 / std::max(message, kTinyMass);
    for (std::size_t k = 0; k < vertices; ++k) {
      const VertexWeight& v = simplices[i * vertices + k];
      kernel.simplices[i * vertices + k].slice =
          to_fixed(std::min(v.weight * mass[v.vertex] * inverse, 1.0F));
    }
    kernel.slice_scale[i] =
        (normalisation == CrfNormalisation::symmetric ? weight * splat_scale[i] * message : weight) / kOne;
  }
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

// One pass over the points; answers the largest move of any marginal.
float DenseCrf::walk(bool has_from, bool has_to) noexcept {
  CrfPass pass{};
  pass.points_count = points_count_;
  pass.unary = unary_.data();
  pass.multiplicity = multiplicity_.data();
  pass.cost = is_potts_ ? nullptr : cost_.data();
  pass.marginals = marginals_.data();
  for (const Kernel& kernel : kernel_)
    if (kernel.is_used)
      pass.kernel[pass.kernels_count++] = {kernel.simplices.data(), per_point(kernel.dimensions),
                                           kernel.slice_scale.data(), kernel.values.data(),
                                           kernel.scratch.data()};
  pass.has_from = has_from;
  pass.has_to = has_to;
  HWY_DYNAMIC_DISPATCH(RunPass)(pass, columns_padded_);
  return pass.change_max;
}

void DenseCrf::blur() noexcept {
  for (Kernel& kernel : kernel_) {
    if (!kernel.is_used) continue;
    std::swap(kernel.values, kernel.scratch);
    for (std::size_t axis = 0; axis < per_point(kernel.dimensions); ++axis) HWY_DYNAMIC_DISPATCH(RunBlur)
    (&kernel.chains[kernel.chain_begin[axis]], kernel.chain_begin[axis + 1] - kernel.chain_begin[axis],
     columns_padded_, kernel.values.data());
  }
}

CrfReport DenseCrf::solve(int iterations_max, float settled_change) noexcept {
  CrfReport report;
  (void)walk(false, iterations_max > 0);
  while (report.iterations < iterations_max) {
    blur();
    ++report.iterations;
    report.change_max = walk(true, report.iterations < iterations_max);
    if (report.change_max < settled_change) break;
  }
  return report;
}

float DenseCrf::iterate() noexcept {
  blur();
  return walk(true, true);
}

bool DenseCrf::change_unary(std::size_t point, const float* cost_nat) noexcept {
  std::array<const float*, kCrfColumnsMax> first{};
  for (std::size_t l = 0; l < kMaterialCount; ++l) {
    const float*& seen = first[column_of_[l]];
    if (seen == nullptr) seen = &cost_nat[l];
    if (*seen != cost_nat[l]) return false;
  }
  load_unary(point, cost_nat);
  return true;
}

void DenseCrf::marginals_of(std::size_t point, std::span<float, kMaterialCount> marginals) const noexcept {
  const auto from = marginals_.subspan(point * columns_padded_, columns_padded_);
  for (std::size_t l = 0; l < kMaterialCount; ++l) marginals[l] = from[column_of_[l]];
}

}  // namespace tactus::label
#endif
