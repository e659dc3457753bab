#include "pipeline/map/predict.hpp"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/map/predict.cpp"
#include "hwy/foreach_target.h"
// clang-format off
#include "hwy/highway.h"
// clang-format on
#include "pipeline/map/predict_rules.hpp"

#ifndef TACTUS_MAP_FIELD_ARRAYS
#define TACTUS_MAP_FIELD_ARRAYS  // this file is compiled once per instruction set
namespace tactus::map {
struct FieldArrays {
  const std::uint32_t* slots;
  std::uint32_t slot_mask;
  int slot_shift;
  const std::uint16_t* neighbours;
  const std::int16_t* tsdf;
};
}  // namespace tactus::map
#endif

HWY_BEFORE_NAMESPACE();
namespace tactus::map::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using F = hn::CappedTag<float, 16>;
using I = hn::RebindToSigned<F>;
using U = hn::RebindToUnsigned<F>;
using VF = hn::Vec<F>;
using VI = hn::Vec<I>;
using MF = hn::Mask<F>;

struct Sampled {
  VF value;
  MF known;
};

// Blocks that the last sample of each lane's ray lay in.
struct LastBlocks {
  VI x, y, z, index;
};

// Pool index of the block at (x, y, z) per lane, 0xFFFF where there is none.
HWY_INLINE VI FindBlocks(const FieldArrays& a, VI x, VI y, VI z, MF wanted) {
  const I di;
  const U du;
  const auto ux = hn::BitCast(du, hn::Add(x, hn::Set(di, kKeyBiasXZ)));
  const auto uy = hn::BitCast(du, hn::Add(y, hn::Set(di, kKeyBiasY)));
  const auto uz = hn::BitCast(du, hn::Add(z, hn::Set(di, kKeyBiasXZ)));
  const auto outside =
      hn::Or(hn::ShiftRight<11>(hn::Or(ux, uz)), hn::ShiftRight<10>(hn::Add(uy, hn::Set(du, 1))));
  auto open = hn::And(hn::RebindMask(du, wanted), hn::Eq(outside, hn::Zero(du)));
  const auto key = hn::Or(ux, hn::Or(hn::ShiftLeft<11>(uz), hn::ShiftLeft<22>(uy)));
  auto slot = hn::ShiftRightSame(hn::Mul(key, hn::Set(du, BlockHash::kMultiplier)), a.slot_shift);
  auto found = hn::Set(du, kNoBlock);
  const auto none = hn::Set(du, kNoKey);
  const auto mask = hn::Set(du, a.slot_mask);
  while (!hn::AllFalse(du, open)) {
    const auto at = hn::BitCast(di, hn::ShiftLeft<1>(hn::IfThenElseZero(open, slot)));
    const auto entry_key = hn::GatherIndex(du, a.slots, at);
    const auto hit = hn::And(open, hn::Eq(entry_key, key));
    if (!hn::AllFalse(du, hit)) found = hn::IfThenElse(hit, hn::GatherIndex(du, a.slots + 1, at), found);
    open = hn::And(open, hn::Not(hn::Or(hit, hn::Eq(entry_key, none))));
    slot = hn::And(hn::Add(slot, hn::Set(du, 1)), mask);
  }
  return hn::BitCast(di, found);
}

HWY_INLINE VF Lerp(VF a, VF b, VF t) { return hn::Add(a, hn::Mul(hn::Sub(b, a), t)); }

// Pool index of the block at (x, y, z) per wanted lane: the last one when it is the same, as it is for most rays.
HWY_INLINE VI FindBlocks(const FieldArrays& a, VI x, VI y, VI z, MF wanted, LastBlocks& last) {
  const I di;
  const auto same = hn::And(hn::Eq(x, last.x), hn::And(hn::Eq(y, last.y), hn::Eq(z, last.z)));
  const auto other = hn::And(hn::RebindMask(di, wanted), hn::Not(same));
  if (!hn::AllFalse(di, other)) {
    const auto found = FindBlocks(a, x, y, z, hn::RebindMask(F(), other));
    last = {x, y, z, hn::IfThenElse(other, found, last.index)};
  }
  return last.index;
}

HWY_INLINE Sampled Sample(const FieldArrays& a, VF x, VF y, VF z, MF wanted, LastBlocks& last) {
  const F df;
  const I di;
  const U du;
  const VF floor_x = hn::Floor(x), floor_y = hn::Floor(y), floor_z = hn::Floor(z);
  const auto ix = hn::ConvertTo(di, floor_x), iy = hn::ConvertTo(di, floor_y),
             iz = hn::ConvertTo(di, floor_z);
  const auto block =
      FindBlocks(a, hn::ShiftRight<3>(ix), hn::ShiftRight<3>(iy), hn::ShiftRight<3>(iz), wanted, last);
  const auto none = hn::Set(di, kNoBlock);
  auto known = hn::And(hn::RebindMask(di, wanted), hn::Ne(block, none));
  const auto base = hn::IfThenElseZero(known, block);
  const auto seven = hn::Set(di, 7);
  const auto lx = hn::And(ix, seven), ly = hn::And(iy, seven), lz = hn::And(iz, seven);
  const auto one = hn::Set(di, 1);
  const VI y1 = hn::Add(ly, one), z1 = hn::Add(lz, one);
  const auto unknown = hn::Set(di, kTsdfUnknown);
  const auto neighbour = [&](VI over) {
    // 16-bit entries through a 32-bit gather; the two bytes read past the table's end lie in the same arena.
    const auto at = hn::ShiftLeft<1>(hn::Add(hn::ShiftLeft<3>(base), over));
    const auto word = hn::GatherOffset(du, reinterpret_cast<const std::uint32_t*>(a.neighbours), at);
    return hn::BitCast(di, hn::And(word, hn::Set(du, 0xFFFFu)));
  };
  const auto voxels = [&](VI holder, VI voxel) {
    const auto at = hn::ShiftLeft<1>(hn::Add(hn::ShiftLeft<9>(holder), voxel));
    return hn::GatherOffset(di, reinterpret_cast<const std::int32_t*>(a.tsdf), at);
  };
  const auto leaves = hn::Eq(lx, seven);  // lanes whose corners at x + 1 lie in another block
  const bool any_leaves = !hn::AllFalse(di, leaves);
  VF v[8];
  for (int edge = 0; edge < 4; ++edge) {  // along x: one gather reads both ends
    const VI cy = edge & 1 ? y1 : ly, cz = edge & 2 ? z1 : lz;
    const auto over =
        hn::Or(hn::ShiftLeft<1>(hn::ShiftRight<3>(cy)), hn::ShiftLeft<2>(hn::ShiftRight<3>(cz)));
    VI holder = base;
    if (edge != 0 && !hn::AllTrue(di, hn::Eq(over, hn::Zero(di)))) {
      holder = neighbour(over);
      known = hn::And(known, hn::Ne(holder, none));
      holder = hn::IfThenElseZero(known, holder);
    }
    const auto row = hn::Or(hn::ShiftLeft<3>(hn::And(cy, seven)), hn::ShiftLeft<6>(hn::And(cz, seven)));
    const auto pair = voxels(holder, hn::Or(lx, row));
    const auto begin = hn::ShiftRight<16>(hn::ShiftLeft<16>(pair));
    auto end = hn::ShiftRight<16>(pair);
    if (any_leaves) {
      const auto next = neighbour(hn::Or(over, one));
      known = hn::And(known, hn::Not(hn::And(leaves, hn::Eq(next, none))));
      const auto there = voxels(hn::IfThenElseZero(hn::And(known, leaves), next), row);
      end = hn::IfThenElse(leaves, hn::ShiftRight<16>(hn::ShiftLeft<16>(there)), end);
    }
    known = hn::And(known, hn::And(hn::Ne(begin, unknown), hn::Ne(end, unknown)));
    v[2 * edge] = hn::ConvertTo(df, begin);
    v[2 * edge + 1] = hn::ConvertTo(df, end);
  }
  const auto tx = hn::Sub(x, floor_x), ty = hn::Sub(y, floor_y), tz = hn::Sub(z, floor_z);
  const auto edge = [&](int i) { return hn::Add(v[i], hn::Mul(hn::Sub(v[i + 1], v[i]), tx)); };
  const auto c00 = edge(0), c10 = edge(2), c01 = edge(4), c11 = edge(6);
  const auto c0 = hn::Add(c00, hn::Mul(hn::Sub(c10, c00), ty)),
             c1 = hn::Add(c01, hn::Mul(hn::Sub(c11, c01), ty));
  return {hn::Mul(Lerp(c0, c1, tz), hn::Set(df, 1.0f / kTsdfScale)), hn::RebindMask(df, known)};
}

HWY_INLINE VF InverseDepth(const float* HWY_RESTRICT z_m) {
  const F df;
  const auto z = hn::LoadU(df, z_m);
  const auto known = hn::Gt(z, hn::Zero(df));
  const auto one = hn::Set(df, 1.0f);
  return hn::IfThenElseZero(known, hn::Div(one, hn::IfThenElse(known, z, one)));
}

// Sums of the fit along one row.
void RowSums(std::size_t row, ModelView& view) {
  const F df;
  const std::size_t lanes = hn::Lanes(df);
  const auto width = static_cast<std::size_t>(view.camera.width);
  const std::size_t first = row * width;
  const auto zero = hn::Zero(df);
  for (float* plane : {view.row_sum.data() + first, view.row_slope.data() + first}) {
    std::fill_n(plane, kFitPixels, 0.0f);
    std::fill_n(plane + width - kFitPixels, kFitPixels, 0.0f);
  }
  const std::size_t end = width - kFitPixels;
  for (std::size_t column = kFitPixels; column < end; column += lanes) {
    const std::size_t pixel = first + (column + lanes <= end ? column : end - lanes);
    auto sum = zero, slope = zero;
    auto complete = hn::Eq(zero, zero);
    for (int k = -kFitPixels; k <= kFitPixels; ++k) {
      const auto inverse = InverseDepth(view.z_m.data() + pixel + k);
      complete = hn::And(complete, hn::Gt(inverse, zero));
      sum = hn::Add(sum, inverse);
      slope = hn::Add(slope, hn::Mul(hn::Set(df, static_cast<float>(k)), inverse));
    }
    hn::StoreU(hn::IfThenElseZero(complete, sum), df, view.row_sum.data() + pixel);
    hn::StoreU(hn::IfThenElseZero(complete, slope), df, view.row_slope.data() + pixel);
  }
}

void PredictGuided(const FieldArrays& a, const PredictConstants& c, const float* HWY_RESTRICT depth,
                   int row_begin, int row_end, ModelView& view) {
  const F df;
  const std::size_t lanes = hn::Lanes(df);
  const auto width = static_cast<std::size_t>(view.camera.width);
  const auto zero = hn::Zero(df), one = hn::Set(df, 1.0f);
  const auto set = [&](float v) { return hn::Set(df, v); };
  for (int row = row_begin; row < row_end; ++row) {
    const float ray_b = (static_cast<float>(row) - c.cy) * c.inverse_fy;
    const auto b = set(ray_b);
    for (std::size_t column = 0; column < width; column += lanes) {
      // The last group of a row whose width is no multiple of the lanes overlaps the one before.
      const std::size_t u = column + lanes <= width ? column : width - lanes;
      const std::size_t pixel = static_cast<std::size_t>(row) * width + u;
      const auto z0 = hn::LoadU(df, depth + pixel);
      const auto measured = hn::Gt(z0, zero);
      auto out_z = zero;
      if (!hn::AllFalse(df, measured)) {
        const auto ray_a =
            hn::Mul(hn::Sub(hn::Iota(df, static_cast<float>(u)), set(c.cx)), set(c.inverse_fx));
        const auto along = [&](std::size_t i) {
          return hn::Mul(
              hn::Add(hn::Add(hn::Mul(set(c.r[i]), ray_a), hn::Mul(set(c.r[i + 1]), b)), set(c.r[i + 2])),
              set(c.scale));
        };
        const auto dx = along(0), dy = along(3), dz = along(6);
        const auto nowhere = hn::Set(I(), INT32_MIN);
        LastBlocks last{nowhere, nowhere, nowhere, hn::Set(I(), kNoBlock)};
        const auto at = [&](VF z, MF wanted) {
          return Sample(a, hn::Add(set(c.ox), hn::Mul(dx, z)), hn::Add(set(c.oy), hn::Mul(dy, z)),
                        hn::Add(set(c.oz), hn::Mul(dz, z)), wanted, last);
        };
        const auto s0 = at(hn::IfThenElseZero(measured, z0), measured);
        auto good = hn::And(s0.known, hn::Lt(hn::Abs(s0.value), set(PredictConstants::kValueMax)));
        if (!hn::AllFalse(df, good)) {
          const auto z1 = hn::IfThenElseZero(good, hn::Add(z0, hn::Mul(s0.value, set(c.truncation_m))));
          const auto s1 = at(z1, good);
          good = hn::And(s1.known, hn::Lt(hn::Abs(s1.value), set(PredictConstants::kResidualMax)));
          const auto change = hn::Sub(s0.value, s1.value);
          const auto secant = hn::Gt(hn::Abs(change), set(PredictConstants::kSlopeMin));
          const auto step = hn::IfThenElse(
              secant, hn::Div(hn::Sub(z1, z0), hn::IfThenElse(secant, change, one)), set(c.truncation_m));
          const auto z = hn::Add(z1, hn::Mul(s1.value, step));
          out_z = hn::IfThenElseZero(hn::And(good, hn::Gt(z, zero)), z);
        }
      }
      hn::StoreU(out_z, df, view.z_m.data() + pixel);
    }
    RowSums(static_cast<std::size_t>(row), view);
  }
}

void PredictNormals(const PredictNormalConstants& c, int row_begin, int row_end, ModelView& view) {
  const F df;
  const std::size_t lanes = hn::Lanes(df);
  const auto width = static_cast<std::size_t>(view.camera.width);
  const auto zero = hn::Zero(df);
  const auto set = [&](float v) { return hn::Set(df, v); };
  for (int row = row_begin; row < row_end; ++row) {
    const std::size_t first = static_cast<std::size_t>(row) * width;
    const bool inside = row >= kFitPixels && row < view.camera.height - kFitPixels;
    for (auto plane : {view.nx, view.ny, view.nz}) {
      std::fill_n(&plane[first], inside ? static_cast<std::size_t>(kFitPixels) : width, 0.0f);
      if (inside) std::fill_n(&plane[first + width - kFitPixels], kFitPixels, 0.0f);
    }
    if (!inside) continue;
    const std::size_t end = width - kFitPixels;
    for (std::size_t column = kFitPixels; column < end; column += lanes) {
      const std::size_t u = column + lanes <= end ? column : end - lanes;
      const std::size_t pixel = first + u;
      auto slope_u = zero, slope_v = zero;
      auto good = hn::Eq(zero, zero);
      for (int k = -kFitPixels; k <= kFitPixels; ++k) {
        const std::ptrdiff_t other =
            static_cast<std::ptrdiff_t>(pixel) + k * static_cast<std::ptrdiff_t>(width);
        const auto sum = hn::LoadU(df, view.row_sum.data() + other);
        good = hn::And(good, hn::Gt(sum, zero));
        slope_u = hn::Add(slope_u, hn::LoadU(df, view.row_slope.data() + other));
        slope_v = hn::Add(slope_v, hn::Mul(set(static_cast<float>(k)), sum));
      }
      const float* z_m = view.z_m.data() + pixel;
      const auto z = hn::LoadU(df, z_m);
      const auto here = InverseDepth(z_m);
      const auto left = InverseDepth(z_m - kFitPixels), right = InverseDepth(z_m + kFitPixels);
      const auto up = InverseDepth(z_m - kFitPixels * width), down = InverseDepth(z_m + kFitPixels * width);
      const auto off = hn::Sub(z, set(0.4f));
      const auto sigma = hn::Add(set(0.0012f), hn::Mul(hn::Mul(set(0.0019f), off), off));
      const auto limit = hn::Add(set(kBendBaseM), hn::Mul(set(kBendSigmas), sigma));
      const auto twice = hn::Add(here, here), z2 = hn::Mul(z, z);
      const auto bend_u = hn::Mul(hn::Abs(hn::Sub(hn::Add(left, right), twice)), z2);
      const auto bend_v = hn::Mul(hn::Abs(hn::Sub(hn::Add(up, down), twice)), z2);
      good = hn::And(good, hn::And(hn::Lt(bend_u, limit), hn::Lt(bend_v, limit)));
      const auto a = hn::Mul(slope_u, set(c.per_pixel)), b = hn::Mul(slope_v, set(c.per_pixel));
      const auto nx = hn::Mul(set(c.fx), a), ny = hn::Mul(set(c.fy), b);
      const auto du = hn::Sub(hn::Iota(df, static_cast<float>(u)), set(c.cx));
      const auto dv = set(static_cast<float>(row) - c.cy);
      const auto nz = hn::Sub(here, hn::Add(hn::Mul(a, du), hn::Mul(b, dv)));
      const auto norm2 = hn::Add(hn::Add(hn::Mul(nx, nx), hn::Mul(ny, ny)), hn::Mul(nz, nz));
      const auto scale = hn::Div(set(-1.0f), hn::Sqrt(hn::IfThenElse(good, norm2, set(1.0f))));
      hn::StoreU(hn::IfThenElseZero(good, hn::Mul(nx, scale)), df, view.nx.data() + pixel);
      hn::StoreU(hn::IfThenElseZero(good, hn::Mul(ny, scale)), df, view.ny.data() + pixel);
      hn::StoreU(hn::IfThenElseZero(good, hn::Mul(nz, scale)), df, view.nz.data() + pixel);
    }
  }
}

}  // namespace tactus::map::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tactus::map {
HWY_EXPORT(PredictGuided);
HWY_EXPORT(PredictNormals);

void predict_normals(int row_begin, int row_end, ModelView& view) noexcept {
  const PredictNormalConstants constants(view);
  HWY_DYNAMIC_DISPATCH(PredictNormals)(constants, row_begin, row_end, view);
}

void predict_guided(const Map& map, std::span<const float> depth_m, int row_begin, int row_end,
                    ModelView& view) noexcept {
  const PredictConstants constants(map, view);
  const FieldArrays arrays{map.hash().words(), map.hash().mask(), map.hash().shift(), map.neighbours(0),
                           map.tsdf(0)};
  HWY_DYNAMIC_DISPATCH(PredictGuided)(arrays, constants, depth_m.data(), row_begin, row_end, view);
}

}  // namespace tactus::map
#endif
