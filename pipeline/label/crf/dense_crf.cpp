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

#ifndef TACTUS_LABEL_CRF_FIELD
#define TACTUS_LABEL_CRF_FIELD  // this file is compiled once per instruction set
namespace tactus::label {

/// What the vectorised loops work on.
struct CrfField {
  struct Kernel {
    const std::uint32_t* simplex_vertices;
    const CrfSimplexVertex* simplices;
    std::size_t per_point;
    const float* slice_scale;
    const CrfBlurSlot* blur;
    const CrfReader* readers;
    std::size_t vertices_count;
    std::int16_t* values;
    std::uint64_t* is_due;
    std::uint64_t* reaches;
  };
  std::array<Kernel, kCrfKernelsMax> kernel;
  std::size_t kernels_count, points_count;
  const float* unary;
  const float* multiplicity;
  const float* cost;  // null: Potts
  float* marginals;
  std::int16_t* splatted;
  std::uint32_t* moved;
  std::int16_t settled;  // 1/32768
  bool is_first;         // nothing was computed before
  bool is_all;           // everything is due, whatever the bits say
};

/// Of one walk over the points.
struct CrfMoves {
  std::size_t points_count;
  std::int16_t change_max;  // 1/32768
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

// The largest |a - b| of all columns.
template <class D>
std::int16_t LargestDifference(D dq, const std::int16_t* a, const std::int16_t* b, std::size_t columns) {
  auto most = hn::Zero(dq);
  for (std::size_t c = 0; c < columns; c += hn::MaxLanes(dq))
    most = hn::Max(most, hn::Abs(hn::Sub(hn::Load(dq, a + c), hn::Load(dq, b + c))));
  return hn::GetLane(hn::MaxOfLanes(dq, most));
}

inline bool IsReached(const CrfField& field, std::size_t point) {
  std::uint64_t reached = 0;
  for (std::size_t m = 0; m < field.kernels_count; ++m) {
    const CrfField::Kernel& kernel = field.kernel[m];
    const std::uint32_t* const vertex = kernel.simplex_vertices + point * kernel.per_point;
    for (std::size_t k = 0; k < kernel.per_point; ++k)
      reached |= kernel.reaches[vertex[k] >> 6] >> (vertex[k] & 63);
  }
  return (reached & 1) != 0;
}

// The slot moved: whoever reads it is due.
inline void Announce(const CrfField::Kernel& kernel, std::size_t slot) {
  const std::uint32_t reader = kernel.readers[slot].bits, k = reader & CrfReader::kIndex;
  const auto set = [](std::uint64_t* bits, std::uint32_t at) { bits[at >> 6] |= 1ULL << (at & 63); };
  if ((reader & CrfReader::kPoints) != 0) return set(kernel.reaches, k);
  set(kernel.is_due, k);
  if ((reader & CrfReader::kBefore) != 0) set(kernel.is_due, k - 1);
  if ((reader & CrfReader::kAfter) != 0) set(kernel.is_due, k + 1);
}

// Softmax of every point that a moved slot reaches; lists the points that moved themselves.
template <std::size_t kColumns>
CrfMoves UpdatePoints(const CrfField& field, bool has_messages) {
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
  CrfMoves moves{0, 0};
  for (std::size_t i = 0; i < field.points_count; ++i) {
    if (!field.is_all && !IsReached(field, i)) continue;
    V x[kVectors];
    for (std::size_t c = 0; c < kVectors; ++c) x[c] = hn::Zero(df);
    if (has_messages) {
      for (std::size_t m = 0; m < field.kernels_count; ++m) {
        const CrfField::Kernel& kernel = field.kernel[m];
        const CrfSimplexVertex* const simplex = kernel.simplices + i * kernel.per_point;
        Q sum[kFixedVectors];
        for (std::size_t c = 0; c < kFixedVectors; ++c) sum[c] = hn::Zero(dq);
        for (std::size_t k = 0; k < kernel.per_point; ++k) {
          const std::int16_t* const from = kernel.values + std::size_t{simplex[k].slice_slot} * kColumns;
          const auto share = hn::Set(dq, simplex[k].slice_share);
          for (std::size_t c = 0; c < kFixedVectors; ++c)
            sum[c] = hn::Add(sum[c], hn::MulFixedPoint15(share, hn::Load(dq, from + c * kFixedLanes)));
        }
        for (std::size_t c = 0; c < kFixedVectors; ++c) hn::Store(sum[c], dq, fixed + c * kFixedLanes);
        const auto scale = hn::Set(df, kernel.slice_scale[i]);
        for (std::size_t c = 0; c < kVectors; ++c)
          x[c] = hn::Add(
              x[c], hn::Mul(scale, hn::ConvertTo(df, hn::PromoteTo(di, hn::Load(dh, fixed + c * kLanes)))));
      }
      if constexpr (kColumns == kCrfColumnsMax) {
        if (field.cost != nullptr) {
          alignas(64) float messages[kColumns];
          for (std::size_t c = 0; c < kVectors; ++c) {
            hn::Store(x[c], df, messages + c * kLanes);
            x[c] = hn::Zero(df);
          }
          for (std::size_t l = 0; l < kMaterialCount; ++l) {
            const auto message = hn::Set(df, messages[l]);
            for (std::size_t c = 0; c < kVectors; ++c)
              x[c] = hn::Sub(x[c], hn::Mul(message, hn::Load(df, field.cost + l * kColumns + c * kLanes)));
          }
        }
      }
    }
    const float* const unary = field.unary + i * kColumns;
    auto most = hn::Set(df, -1e30F);
    for (std::size_t c = 0; c < kVectors; ++c) {
      x[c] = hn::Sub(x[c], hn::Load(df, unary + c * kLanes));
      most = hn::Max(most, x[c]);
    }
    most = hn::MaxOfLanes(df, most);
    for (std::size_t c = 0; c < kVectors; ++c) {
      x[c] = Exponential(df, hn::Sub(x[c], most));
      hn::Store(hn::Mul(x[c], hn::Load(df, field.multiplicity + c * kLanes)), df, exponentials + c * kLanes);
    }
    float partial[8];
    for (std::size_t l = 0; l < 8; ++l) {
      partial[l] = exponentials[l];
      for (std::size_t c = 8; c < kColumns; c += 8) partial[l] += exponentials[l + c];
    }
    const float total = ((partial[0] + partial[4]) + (partial[2] + partial[6])) +
                        ((partial[1] + partial[5]) + (partial[3] + partial[7]));
    const auto inverse = hn::Set(df, 1.0F / total);
    float* const marginals = field.marginals + i * kColumns;
    for (std::size_t c = 0; c < kVectors; ++c) {
      x[c] = hn::Mul(x[c], inverse);
      hn::Store(x[c], df, marginals + c * kLanes);
      const auto rounded =
          hn::ConvertTo(di, hn::Add(hn::Mul(x[c], hn::Set(df, 32767.0F)), hn::Set(df, 0.5F)));
      hn::Store(hn::DemoteTo(dh, rounded), dh, fixed + c * kLanes);
    }
    const std::int16_t change = LargestDifference(dq, fixed, field.splatted + i * kColumns, kColumns);
    if (change > moves.change_max) moves.change_max = change;
    if (change > field.settled) field.moved[moves.points_count++] = static_cast<std::uint32_t>(i);
  }
  return moves;
}

// Adds to the splat slots by how much the listed points moved.
template <std::size_t kColumns>
void Splat(const CrfField& field, std::size_t moved_count) {
  const FloatTag<kColumns> df;
  const FixedTag<kColumns> dq;
  const hn::Rebind<std::int16_t, FloatTag<kColumns>> dh;
  const hn::RebindToSigned<FloatTag<kColumns>> di;
  constexpr std::size_t kLanes = hn::MaxLanes(FloatTag<kColumns>()), kVectors = kColumns / kLanes;
  constexpr std::size_t kFixedLanes = hn::MaxLanes(FixedTag<kColumns>()),
                        kFixedVectors = kColumns / kFixedLanes;
  using Q = hn::Vec<FixedTag<kColumns>>;
  for (std::size_t listed = 0; listed < moved_count; ++listed) {
    const std::size_t i = field.moved[listed];
    std::int16_t* const splatted = field.splatted + i * kColumns;
    Q before[kFixedVectors], now[kFixedVectors];
    for (std::size_t c = 0; c < kFixedVectors; ++c) before[c] = hn::Load(dq, splatted + c * kFixedLanes);
    for (std::size_t c = 0; c < kVectors; ++c) {
      const auto x = hn::Load(df, field.marginals + i * kColumns + c * kLanes);
      const auto rounded = hn::ConvertTo(di, hn::Add(hn::Mul(x, hn::Set(df, 32767.0F)), hn::Set(df, 0.5F)));
      hn::Store(hn::DemoteTo(dh, rounded), dh, splatted + c * kLanes);
    }
    for (std::size_t c = 0; c < kFixedVectors; ++c) now[c] = hn::Load(dq, splatted + c * kFixedLanes);
    for (std::size_t m = 0; m < field.kernels_count; ++m) {
      const CrfField::Kernel& kernel = field.kernel[m];
      const CrfSimplexVertex* const simplex = kernel.simplices + i * kernel.per_point;
      const std::uint32_t* const vertex = kernel.simplex_vertices + i * kernel.per_point;
      for (std::size_t k = 0; k < kernel.per_point; ++k) {
        std::int16_t* const to = kernel.values + std::size_t{vertex[k]} * kColumns;
        if (!field.is_all) Announce(kernel, vertex[k]);
        const auto share = hn::Set(dq, simplex[k].splat_share);
        for (std::size_t c = 0; c < kFixedVectors; ++c)
          hn::Store(
              hn::Add(hn::Load(dq, to + c * kFixedLanes),
                      hn::Sub(hn::MulFixedPoint15(share, now[c]), hn::MulFixedPoint15(share, before[c]))),
              dq, to + c * kFixedLanes);
      }
    }
  }
}

// One blur slot; whether it moved. A row's end has no share in what lies beyond it.
template <std::size_t kColumns>
HWY_INLINE bool BlurSlot(const CrfField::Kernel& kernel, std::size_t k, std::int16_t settled, bool is_first) {
  const FixedTag<kColumns> dq;
  constexpr std::size_t kLanes = hn::MaxLanes(FixedTag<kColumns>()), kVectors = kColumns / kLanes;
  const CrfBlurSlot& slot = kernel.blur[k];
  const std::size_t before_k = k - (slot.before_share != 0 ? 1 : 0),
                    after_k = k + (slot.after_share != 0 ? 1 : 0);
  const std::int16_t* const before = kernel.values + std::size_t{kernel.blur[before_k].from_slot} * kColumns;
  const std::int16_t* const here = kernel.values + std::size_t{slot.from_slot} * kColumns;
  const std::int16_t* const after = kernel.values + std::size_t{kernel.blur[after_k].from_slot} * kColumns;
  std::int16_t* const to = kernel.values + (kernel.vertices_count + k) * kColumns;
  const auto before_share = hn::Set(dq, slot.before_share), after_share = hn::Set(dq, slot.after_share);
  hn::Vec<FixedTag<kColumns>> fresh[kVectors];
  for (std::size_t c = 0; c < kVectors; ++c) {
    const auto at = hn::Load(dq, here + c * kLanes);
    fresh[c] =
        hn::Add(at, hn::Add(hn::MulFixedPoint15(before_share, hn::Sub(hn::Load(dq, before + c * kLanes), at)),
                            hn::MulFixedPoint15(after_share, hn::Sub(hn::Load(dq, after + c * kLanes), at))));
  }
  if (!is_first) {
    auto most = hn::Zero(dq);
    for (std::size_t c = 0; c < kVectors; ++c)
      most = hn::Max(most, hn::Abs(hn::Sub(fresh[c], hn::Load(dq, to + c * kLanes))));
    if (hn::AllFalse(dq, hn::Gt(most, hn::Set(dq, settled)))) return false;
  }
  for (std::size_t c = 0; c < kVectors; ++c) hn::Store(fresh[c], dq, to + c * kLanes);
  return true;
}

// The due blur slots from `begin` to `end`, one axis.
template <std::size_t kColumns>
void Blur(const CrfField& field, const CrfField::Kernel& kernel, std::size_t begin, std::size_t end) {
  if (field.is_all) {
    for (std::size_t k = begin; k < end; ++k)
      static_cast<void>(BlurSlot<kColumns>(kernel, k, field.settled, field.is_first));
    return;
  }
  for (std::size_t k = begin; k < end; k = (k / 64 + 1) * 64) {
    std::uint64_t mask = ~0ULL << (k % 64);  // the rest of the word, as far as this axis goes
    if (end - k / 64 * 64 < 64) mask &= (1ULL << (end % 64)) - 1;
    std::uint64_t due = kernel.is_due[k / 64] & mask;
    kernel.is_due[k / 64] &= ~mask;
    for (; due != 0; due &= due - 1) {
      const std::size_t at = k / 64 * 64 + hwy::Num0BitsBelowLS1Bit_Nonzero64(due);
      if (BlurSlot<kColumns>(kernel, at, field.settled, false)) Announce(kernel, kernel.vertices_count + at);
    }
  }
}

CrfMoves RunUpdatePoints(const CrfField& field, std::size_t columns, bool has_messages) {
  if (columns == 8) return UpdatePoints<8>(field, has_messages);
  if (columns == 16) return UpdatePoints<16>(field, has_messages);
  return UpdatePoints<24>(field, has_messages);
}

void RunSplat(const CrfField& field, std::size_t columns, std::size_t moved_count) {
  if (columns == 8) return Splat<8>(field, moved_count);
  if (columns == 16) return Splat<16>(field, moved_count);
  return Splat<24>(field, moved_count);
}

void RunBlur(const CrfField& field, std::size_t columns, const CrfField::Kernel& kernel, std::size_t begin,
             std::size_t end) {
  if (columns == 8) return Blur<8>(field, kernel, begin, end);
  if (columns == 16) return Blur<16>(field, kernel, begin, end);
  return Blur<24>(field, kernel, begin, end);
}

}  // namespace tactus::label::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tactus::label {
HWY_EXPORT(RunUpdatePoints);
HWY_EXPORT(RunSplat);
HWY_EXPORT(RunBlur);

namespace {

constexpr float kPaddedCostNat = 1e20F;  // its exponential is 0
constexpr float kTinyMass = 1e-20F;
constexpr float kOne = 32767;  // in 1/32768: what fits 16 bits and means 1

// Adding a kernel in pieces: points a piece, and prices.
constexpr std::size_t kEmbedPoints = 2048, kSharePoints = 8192;
constexpr std::uint64_t kEmbedVertexNs = 45, kLinkVertexNs = 40, kBlurSlotNs = 8, kShareVertexNs = 4;

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

constexpr std::size_t words(std::size_t bits) { return (bits + 63) / 64; }

// A share in 1/32768. What rounding down leaves goes on to the next share through `carry`, so that shares
// which sum to 1 never sum to more in fixed point: a sum of share * value then fits its 16 bits.
std::int16_t to_fixed(float share, float& carry) {
  const float exact = share * kOne + carry;
  const auto fixed = static_cast<std::int16_t>(std::min(exact, kOne));
  carry = std::min(exact - static_cast<float>(fixed), 1.0F);
  return fixed;
}
std::int16_t to_fixed(float share) { return static_cast<std::int16_t>(share * kOne + 0.5F); }

}  // namespace

std::size_t DenseCrf::bytes_needed(const DenseCrfConfig& config) {
  const std::size_t vertices_max = vertices_max_of(config);
  std::size_t bytes = LatticeHash::bytes_needed(vertices_max) +
                      Lattice::bytes_needed(dimensions_max_of(config), config.points_max, vertices_max) +
                      rt::bytes_of<std::uint32_t>(vertices_max) + 3 * rt::bytes_of<float>(vertices_max) +
                      rt::bytes_of<float>(config.points_max * kLatticeDimensionsMax) +
                      2 * rt::bytes_of<float>(config.points_max * kCrfColumnsMax) +
                      rt::bytes_of<std::int16_t>(config.points_max * kCrfColumnsMax) +
                      rt::bytes_of<std::uint32_t>(config.points_max);
  for (const auto& kernel : config.kernel)
    if (kernel.dimensions != 0)
      bytes += rt::bytes_of<std::uint32_t>(config.points_max * per_point(kernel.dimensions)) +
               rt::bytes_of<CrfSimplexVertex>(config.points_max * per_point(kernel.dimensions)) +
               rt::bytes_of<CrfBlurSlot>(kernel.slots_max) + rt::bytes_of<float>(config.points_max) +
               rt::bytes_of<std::int16_t>(kernel.slots_max * kCrfColumnsMax) +
               rt::bytes_of<CrfReader>(kernel.slots_max) +
               rt::bytes_of<std::uint64_t>(words(kernel.slots_max)) +
               rt::bytes_of<std::uint64_t>(words(kernel.vertices_max));
  return bytes;
}

void DenseCrf::bind(rt::Slice& memory, const DenseCrfConfig& config) {
  config_ = config;
  const std::size_t vertices_max = vertices_max_of(config);
  hash_.bind(memory, vertices_max);
  lattice_.bind(memory, dimensions_max_of(config), config.points_max, vertices_max);
  scratch_ = memory.take<std::uint32_t>(vertices_max);
  mass_ = memory.take<float>(vertices_max);
  inverse_mass_ = memory.take<float>(vertices_max);
  carry_ = memory.take<float>(vertices_max);
  features_ = memory.take<float>(config.points_max * kLatticeDimensionsMax);
  unary_ = memory.take<float>(config.points_max * kCrfColumnsMax);
  marginals_ = memory.take<float>(config.points_max * kCrfColumnsMax);
  splatted_ = memory.take<std::int16_t>(config.points_max * kCrfColumnsMax);
  moved_ = memory.take<std::uint32_t>(config.points_max);
  for (std::size_t m = 0; m < kCrfKernelsMax; ++m) {
    const auto& wanted = config.kernel[m];
    Kernel& kernel = kernel_[m];
    kernel.dimensions = wanted.dimensions;
    if (wanted.dimensions == 0) continue;
    kernel.simplex_vertices = memory.take<std::uint32_t>(config.points_max * kernel.per_point());
    kernel.simplices = memory.take<CrfSimplexVertex>(config.points_max * kernel.per_point());
    kernel.blur = memory.take<CrfBlurSlot>(wanted.slots_max);
    kernel.slice_scale = memory.take<float>(config.points_max);
    kernel.values = memory.take<std::int16_t>(wanted.slots_max * kCrfColumnsMax);
    kernel.readers = memory.take<CrfReader>(wanted.slots_max);
    kernel.is_due = memory.take<std::uint64_t>(words(wanted.slots_max));
    kernel.reaches = memory.take<std::uint64_t>(words(wanted.vertices_max));
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
  begin_kernel(m, weight, features, normalisation);
  CrfPiece piece;
  while (!piece.is_last) piece = continue_kernel();
  return piece.status;
}

void DenseCrf::begin_kernel(std::size_t m, float weight, std::span<const float> features,
                            CrfNormalisation normalisation) noexcept {
  TACTUS_ASSERT(m < kCrfKernelsMax && config_.kernel[m].dimensions != 0);
  TACTUS_ASSERT(features.size() == points_count_ * static_cast<std::size_t>(config_.kernel[m].dimensions));
  kernel_[m].is_used = false;
  build_ = {m, weight, features, normalisation, BuildStage::embed, 0, 0};
}

// Masses: of a vertex what all points put there, splat_scale each; blurred along one axis after the other,
// they give the neighbours' shares; sliced, they give the point's message its size.
CrfPiece DenseCrf::continue_kernel() noexcept {
  Kernel& kernel = kernel_[build_.kernel];
  if (build_.weight == 0 || points_count_ == 0) return {rt::Status::ok, true, 1};
  const std::size_t per_point = kernel.per_point(), first = build_.next;
  const std::size_t piece = build_.stage == BuildStage::embed ? kEmbedPoints : kSharePoints;
  const std::size_t count = std::min(piece, points_count_ - std::min(first, points_count_));
  const auto splat_scale = marginals_.first(points_count_), degree = unary_.first(points_count_);
  const auto axis = static_cast<int>(first);
  // Of all points, or of all axes; then the next stage begins.
  const auto go_on = [&](std::size_t done, std::size_t end, BuildStage next) {
    build_.next += done;
    if (build_.next == end) enter(next);
  };
  switch (build_.stage) {
    case BuildStage::embed: {
      if (first == 0) {
        hash_.clear(config_.kernel[build_.kernel].vertices_max);
        const rt::Status begun = lattice_.begin_build(kernel.dimensions, points_count_, hash_);
        if (begun != rt::Status::ok) return {begun, true, 1};
      }
      const std::uint64_t price = kEmbedVertexNs * per_point * count;
      const rt::Status embedded = lattice_.embed_points(build_.features, first, count, hash_);
      if (embedded != rt::Status::ok) return {embedded, true, price};
      go_on(count, points_count_, BuildStage::link);
      return {rt::Status::ok, false, price};
    }
    case BuildStage::link: {
      lattice_.link_axis(axis, hash_, scratch_);
      const std::uint64_t price = kLinkVertexNs * lattice_.vertices_count();
      if (first + 1 == per_point) {
        kernel.vertices_count = lattice_.vertices_count();
        std::size_t slots = kernel.vertices_count;
        for (int a = 0; a <= kernel.dimensions; ++a) slots += lattice_.chains(a).size();
        if (slots > config_.kernel[build_.kernel].slots_max) return {rt::Status::full, true, price};
      }
      go_on(
          1, per_point,
          build_.normalisation == CrfNormalisation::symmetric ? BuildStage::degree_splat : BuildStage::mass);
      return {rt::Status::ok, false, price};
    }
    case BuildStage::degree_splat:
      lattice_splat(lattice_, splat_scale, first, count, mass_);
      go_on(count, points_count_, BuildStage::degree_blur);
      break;
    case BuildStage::degree_blur: {
      const std::uint64_t price = kBlurSlotNs * lattice_.chains(axis).size() + 1;
      lattice_blur(lattice_, axis, mass_);
      go_on(1, per_point, BuildStage::degree_slice);
      return {rt::Status::ok, false, price};
    }
    case BuildStage::degree_slice:
      lattice_slice(lattice_, mass_, first, count, degree);
      for (std::size_t i = first; i < first + count; ++i)
        splat_scale[i] = 1 / std::sqrt(std::max(degree[i], kTinyMass));
      go_on(count, points_count_, BuildStage::mass);
      break;
    case BuildStage::mass:
      lattice_splat(lattice_, splat_scale, first, count, mass_);
      go_on(count, points_count_, BuildStage::splat_share);
      break;
    case BuildStage::splat_share:
      add_splat_shares(kernel, first, count);
      go_on(count, points_count_, BuildStage::blur);
      break;
    case BuildStage::blur: {
      const std::uint64_t price = kBlurSlotNs * lattice_.chains(axis).size() + 1;
      add_blur_slots(kernel, axis);
      go_on(1, per_point, BuildStage::slice_share);
      return {rt::Status::ok, false, price};
    }
    case BuildStage::slice_share:
      add_slice_shares(kernel, first, count);
      build_.next += count;
      kernel.is_used = build_.next == points_count_;
      break;
  }
  return {rt::Status::ok, kernel.is_used, kShareVertexNs * per_point * count};
}

// What a stage finds before its first piece.
void DenseCrf::enter(BuildStage stage) noexcept {
  const Kernel& kernel = kernel_[build_.kernel];
  const auto mass = mass_.first(lattice_.vertices_count());
  if (stage == BuildStage::degree_splat ||
      (stage == BuildStage::mass && build_.normalisation == CrfNormalisation::per_point))
    std::fill_n(marginals_.begin(), points_count_, 1.0F);
  if (stage == BuildStage::degree_splat || stage == BuildStage::mass)
    std::fill(mass.begin(), mass.end(), 0.0F);
  if (stage == BuildStage::splat_share) {
    std::fill_n(carry_.begin(), mass.size(), 0.0F);
    for (std::size_t v = 0; v < mass.size(); ++v) inverse_mass_[v] = 1 / std::max(mass[v], kTinyMass);
  }
  if (stage == BuildStage::blur)
    for (std::uint32_t v = 0; v < mass.size(); ++v)
      scratch_[v] = v;  // the slot that holds each vertex so far
  if (stage == BuildStage::slice_share)
    for (std::uint32_t v = 0; v < mass.size(); ++v) kernel.readers[scratch_[v]].bits = v | CrfReader::kPoints;
  build_.stage = stage;
  build_.next = 0;
}

void DenseCrf::add_splat_shares(Kernel& kernel, std::size_t first, std::size_t count) noexcept {
  const std::size_t vertices = kernel.per_point();
  const auto simplices = lattice_.simplices();
  for (std::size_t i = first; i < first + count; ++i)
    for (std::size_t k = 0; k < vertices; ++k) {
      const VertexWeight& v = simplices[i * vertices + k];
      const float share = std::min(v.weight * marginals_[i] * inverse_mass_[v.vertex], 1.0F);
      kernel.simplex_vertices[i * vertices + k] = v.vertex;
      kernel.simplices[i * vertices + k] = {0, to_fixed(share, carry_[v.vertex]), 0};
    }
}

void DenseCrf::add_blur_slots(Kernel& kernel, int axis) noexcept {
  std::size_t& length = build_.length;
  kernel.axis_begin[static_cast<std::size_t>(axis)] = length;
  float before = 0;
  const auto chain = lattice_.chains(axis);
  for (std::size_t k = 0; k < chain.size(); ++k) {
    const bool is_last = (chain[k] & kChainEnd) != 0;
    const std::uint32_t v = chain[k] & ~kChainEnd;
    const float old = mass_[v], after = is_last ? 0 : mass_[chain[k + 1] & ~kChainEnd];
    mass_[v] = old + 0.5F * (before + after);
    const float inverse = 0.5F / std::max(mass_[v], kTinyMass);
    kernel.blur[length + k] = {scratch_[v], to_fixed(before * inverse), to_fixed(after * inverse)};
    before = is_last ? 0 : old;
  }
  for (std::size_t k = 0; k < chain.size(); ++k, ++length) {
    std::uint32_t& slot = scratch_[chain[k] & ~kChainEnd];
    const bool is_read_before = k > 0 && kernel.blur[length - 1].after_share != 0;
    const bool is_read_after = k + 1 < chain.size() && kernel.blur[length + 1].before_share != 0;
    kernel.readers[slot].bits = static_cast<std::uint32_t>(length) |
                                (is_read_before ? CrfReader::kBefore : 0) |
                                (is_read_after ? CrfReader::kAfter : 0);
    slot = kernel.vertices_count + static_cast<std::uint32_t>(length);
  }
  kernel.axis_begin[static_cast<std::size_t>(axis) + 1] = length;
}

void DenseCrf::add_slice_shares(Kernel& kernel, std::size_t first, std::size_t count) noexcept {
  const std::size_t vertices = kernel.per_point();
  const auto simplices = lattice_.simplices();
  for (std::size_t i = first; i < first + count; ++i) {
    float message = 0;
    for (const VertexWeight& v : simplices.subspan(i * vertices, vertices))
      message += v.weight * mass_[v.vertex];
    const float inverse = 1 / std::max(message, kTinyMass);
    float left = 0;
    for (std::size_t k = 0; k < vertices; ++k) {
      const VertexWeight& v = simplices[i * vertices + k];
      CrfSimplexVertex& out = kernel.simplices[i * vertices + k];
      out.slice_slot = scratch_[v.vertex];
      out.slice_share = to_fixed(v.weight * mass_[v.vertex] * inverse, left);
    }
    kernel.slice_scale[i] =
        (build_.normalisation == CrfNormalisation::symmetric ? build_.weight * marginals_[i] * message
                                                             : build_.weight) /
        kOne;
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

CrfField DenseCrf::field() noexcept {
  CrfField field{};
  field.points_count = points_count_;
  field.unary = unary_.data();
  field.multiplicity = multiplicity_.data();
  field.cost = is_potts_ ? nullptr : cost_.data();
  field.marginals = marginals_.data();
  field.splatted = splatted_.data();
  field.moved = moved_.data();
  field.settled = settled_;
  for (const Kernel& kernel : kernel_)
    if (kernel.is_used)
      field.kernel[field.kernels_count++] = {
          kernel.simplex_vertices.data(), kernel.simplices.data(), kernel.per_point(),
          kernel.slice_scale.data(),      kernel.blur.data(),      kernel.readers.data(),
          kernel.vertices_count,          kernel.values.data(),    kernel.is_due.data(),
          kernel.reaches.data()};
  return field;
}

std::size_t DenseCrf::start(float settled_change) noexcept {
  settled_ = static_cast<std::int16_t>(std::clamp(settled_change, -1.0F, 1.0F) * kOne);
  for (const Kernel& kernel : kernel_) {
    if (!kernel.is_used) continue;
    std::fill_n(kernel.values.begin(), kernel.vertices_count * columns_padded_, std::int16_t{0});
    std::fill(kernel.is_due.begin(), kernel.is_due.end(), 0);
  }
  std::fill_n(splatted_.begin(), points_count_ * columns_padded_, std::int16_t{0});
  is_first_ = true;
  is_unary_changed_ = false;
  CrfField field = this->field();
  field.is_first = field.is_all = true;
  const CrfMoves moves = HWY_DYNAMIC_DISPATCH(RunUpdatePoints)(field, columns_padded_, false);
  moved_count_ = moves.points_count;
  change_max_ = moves.change_max;
  return moved_count_;
}

std::size_t DenseCrf::iterate() noexcept {
  if (moved_count_ == 0 && !is_unary_changed_) return 0;
  CrfField field = this->field();
  field.is_first = is_first_;
  // Where most points moved, nearly every slot is due: looking for them costs more than it saves.
  field.is_all = is_first_ || 2 * moved_count_ > points_count_;
  for (const Kernel& kernel : kernel_)
    if (kernel.is_used) std::fill(kernel.reaches.begin(), kernel.reaches.end(), 0);
  HWY_DYNAMIC_DISPATCH(RunSplat)(field, columns_padded_, moved_count_);
  std::size_t m = 0;
  for (const Kernel& kernel : kernel_) {
    if (!kernel.is_used) continue;
    for (std::size_t axis = 0; axis < kernel.per_point(); ++axis) HWY_DYNAMIC_DISPATCH(RunBlur)
    (field, columns_padded_, field.kernel[m], kernel.axis_begin[axis], kernel.axis_begin[axis + 1]);
    ++m;
  }
  field.is_first = false;
  field.is_all = field.is_all || is_unary_changed_;
  const CrfMoves moves = HWY_DYNAMIC_DISPATCH(RunUpdatePoints)(field, columns_padded_, true);
  is_first_ = is_unary_changed_ = false;
  moved_count_ = moves.points_count;
  change_max_ = moves.change_max;
  return moved_count_;
}

CrfReport DenseCrf::solve(int iterations_max, float settled_change) noexcept {
  CrfReport report;
  (void)start(settled_change);
  while (report.iterations < iterations_max && moved_count_ > 0) {
    report.points_updated += iterate();
    ++report.iterations;
    report.change_max = static_cast<float>(change_max_) / kOne;
  }
  return report;
}

bool DenseCrf::change_unary(std::size_t point, const float* cost_nat) noexcept {
  std::array<const float*, kCrfColumnsMax> first{};
  for (std::size_t l = 0; l < kMaterialCount; ++l) {
    const float*& seen = first[column_of_[l]];
    if (seen == nullptr) seen = &cost_nat[l];
    if (*seen != cost_nat[l]) return false;
  }
  load_unary(point, cost_nat);
  is_unary_changed_ = true;
  return true;
}

void DenseCrf::marginals_of(std::size_t point, std::span<float, kMaterialCount> marginals) const noexcept {
  const auto from = marginals_.subspan(point * columns_padded_, columns_padded_);
  for (std::size_t l = 0; l < kMaterialCount; ++l) marginals[l] = from[column_of_[l]];
}

}  // namespace tactus::label
#endif
