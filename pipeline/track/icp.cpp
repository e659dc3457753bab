#include "pipeline/track/icp.hpp"

#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/track/icp.cpp"
#include "hwy/foreach_target.h"
// clang-format off
#include "hwy/highway.h"
// clang-format on
#include "pipeline/track/icp_rules.hpp"

HWY_BEFORE_NAMESPACE();
namespace tactus::track::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using F = hn::CappedTag<float, kVirtualLanes>;
using I = hn::RebindToSigned<F>;
using VF = hn::Vec<F>;
using VI = hn::Vec<I>;
using MF = hn::Mask<F>;

// acc[i] += value, for the virtual lanes beginning at `lane`.
HWY_INLINE void Accumulate(float (*HWY_RESTRICT acc)[kVirtualLanes], std::size_t i, std::size_t lane,
                           VF value) {
  const F df;
  hn::Store(hn::Add(hn::Load(df, acc[i] + lane), value), df, acc[i] + lane);
}

// Adds w J^T J and w J^T r for J = (lever x n, n).
HWY_INLINE void AccumulatePlane(float (*HWY_RESTRICT acc)[kVirtualLanes], std::size_t lane, const VF (&j)[6],
                                VF w, VF wr) {
  std::size_t k = 0;
  for (std::size_t i = 0; i < 6; ++i) {
    const auto wj = hn::Mul(w, j[i]);
    for (std::size_t l = i; l < 6; ++l) Accumulate(acc, k++, lane, hn::Mul(wj, j[l]));
  }
  for (std::size_t i = 0; i < 6; ++i) Accumulate(acc, kRowB + i, lane, hn::Mul(wr, j[i]));
}

HWY_INLINE void AccumulateBrightness(const IcpConstants& c, const BrightnessWord* HWY_RESTRICT model,
                                     const Luma* HWY_RESTRICT live, int width, int height, VI at, VF px, VF py,
                                     VF z, VF fu, VF fv, VF qx, VF qy, VF qz, MF inlier, std::size_t lane,
                                     float (*HWY_RESTRICT acc)[kVirtualLanes]) {
  const F df;
  const I di;
  const hn::RebindToUnsigned<F> du;
  const auto set = [&](float v) { return hn::Set(df, v); };
  const auto zero = hn::Zero(df), one = set(1.0f);
  // Bilinear in the live image: all four pixels inside.
  auto use =
      hn::And(inlier, hn::And(hn::And(hn::Gt(fu, zero), hn::Lt(fu, set(static_cast<float>(width - 1)))),
                              hn::And(hn::Gt(fv, zero), hn::Lt(fv, set(static_cast<float>(height - 1))))));
  const auto word = hn::BitCast(di, hn::GatherIndex(du, model, hn::IfThenElseZero(hn::RebindMask(di, use), at)));
  use = hn::And(use, hn::RebindMask(df, hn::Ne(word, hn::Zero(di))));
  if (hn::AllFalse(df, use)) return;
  const VF u0 = hn::Floor(hn::IfThenElseZero(use, fu)), v0 = hn::Floor(hn::IfThenElseZero(use, fv));
  const auto tu = hn::Sub(hn::IfThenElseZero(use, fu), u0), tv = hn::Sub(hn::IfThenElseZero(use, fv), v0);
  const auto corner = hn::Add(hn::Mul(hn::ConvertTo(di, v0), hn::Set(di, width)), hn::ConvertTo(di, u0));
  // Neighbouring bytes through one 32-bit gather; the image is padded.
  const auto upper = hn::GatherOffset(du, reinterpret_cast<const std::uint32_t*>(live), corner);
  const auto lower = hn::GatherOffset(du, reinterpret_cast<const std::uint32_t*>(live + width), corner);
  const auto byte = hn::Set(du, 0xFFu);
  const auto as_float = [&](auto bits) { return hn::ConvertTo(df, hn::BitCast(di, hn::And(bits, byte))); };
  const auto l00 = as_float(upper), l10 = as_float(hn::ShiftRight<8>(upper));
  const auto l01 = as_float(lower), l11 = as_float(hn::ShiftRight<8>(lower));
  use = hn::And(use, hn::Gt(hn::Min(hn::Min(l00, l10), hn::Min(l01, l11)), zero));
  const auto top = hn::Add(l00, hn::Mul(hn::Sub(l10, l00), tu)),
             bottom = hn::Add(l01, hn::Mul(hn::Sub(l11, l01), tu));
  const auto seen = hn::Add(top, hn::Mul(hn::Sub(bottom, top), tv));
  const auto m = hn::Mul(hn::ConvertTo(df, hn::And(word, hn::Set(di, 0x3FF))), set(0.25f));
  const auto along_u = hn::ConvertTo(df, hn::ShiftRight<21>(hn::ShiftLeft<11>(word)));
  const auto along_v = hn::ConvertTo(df, hn::ShiftRight<21>(word));
  const auto r_grey = hn::Sub(seen, m);
  use = hn::And(use, hn::Lt(hn::Abs(r_grey), set(IcpConstants::kGreyGate)));
  const auto size = hn::Abs(r_grey);
  const auto huber = hn::IfThenElse(hn::Gt(size, set(IcpConstants::kGreyHuber)),
                                    hn::Div(set(IcpConstants::kGreyHuber), hn::Max(size, one)), one);
  const auto w = hn::IfThenElseZero(use, huber);
  const auto scale = set(IcpConstants::kGradientScale);
  const auto inverse_z = hn::Div(one, hn::IfThenElse(use, z, one));  // lanes left out stay finite
  const auto gx = hn::Mul(hn::Mul(hn::Mul(along_u, scale), set(c.fx)), inverse_z);
  const auto gy = hn::Mul(hn::Mul(hn::Mul(along_v, scale), set(c.fy)), inverse_z);
  const auto gz = hn::Neg(hn::Mul(hn::Add(hn::Mul(gx, px), hn::Mul(gy, py)), inverse_z));
  const auto cz = hn::Sub(qz, set(c.pivot_z));
  const VF j[6] = {hn::Sub(hn::Mul(qy, gz), hn::Mul(cz, gy)),
                   hn::Sub(hn::Mul(cz, gx), hn::Mul(qx, gz)),
                   hn::Sub(hn::Mul(qx, gy), hn::Mul(qy, gx)),
                   gx,
                   gy,
                   gz};
  AccumulatePlane(acc, lane, j, w, hn::Mul(w, hn::Mul(r_grey, set(IcpConstants::kMetresPerGrey))));
}

void IcpChunk(const IcpConstants& c, const map::ModelView& model, const float* HWY_RESTRICT live,
              const BrightnessWord* HWY_RESTRICT model_brightness, const Luma* HWY_RESTRICT live_luma, int stride,
              int row_begin, int row_end, float (*HWY_RESTRICT acc)[kVirtualLanes]) {
  const F df;
  const I di;
  const std::size_t lanes = hn::Lanes(df);
  const auto set = [&](float v) { return hn::Set(df, v); };
  const auto zero = hn::Zero(df), one = set(1.0f);
  const int width = model.camera.width;
  const auto columns = static_cast<std::size_t>((width + stride - 1) / stride);
  const auto width_i = hn::Set(di, width), height_i = hn::Set(di, model.camera.height),
             minus_one = hn::Set(di, -1);
  for (int row = row_begin; row < row_end; row += stride) {
    const auto b = set((static_cast<float>(row) - c.cy) * c.inverse_fy);
    for (std::size_t group = 0; group < columns; group += kVirtualLanes) {
      for (std::size_t lane = 0; lane < kVirtualLanes; lane += lanes) {
        const auto column = hn::Add(hn::Iota(di, static_cast<std::int32_t>(group + lane)), hn::Zero(di));
        const auto u = hn::Mul(column, hn::Set(di, stride));
        const auto in_row = hn::Lt(u, width_i);
        const auto at = hn::Add(hn::IfThenElseZero(in_row, u), hn::Set(di, row * width));
        const auto z = hn::GatherIndex(df, model.z_m.data(), at);
        const auto is_model = hn::And(hn::RebindMask(df, in_row), hn::Gt(z, zero));
        if (hn::AllFalse(df, is_model)) continue;
        const auto a = hn::Mul(hn::Sub(hn::ConvertTo(df, u), set(c.cx)), set(c.inverse_fx));
        const auto px = hn::Mul(a, z), py = hn::Mul(b, z);
        // Into the live camera.
        const auto to_live = [&](std::size_t i) {
          return hn::Add(hn::Add(hn::Mul(set(c.to_live[i * 4]), px), hn::Mul(set(c.to_live[i * 4 + 1]), py)),
                         hn::Add(hn::Mul(set(c.to_live[i * 4 + 2]), z), set(c.to_live[i * 4 + 3])));
        };
        const auto lx = to_live(0), ly = to_live(1), lz = to_live(2);
        const auto in_front = hn::Gt(lz, set(IcpConstants::kNearM));
        const auto inverse = hn::Div(one, hn::IfThenElse(in_front, lz, one));
        const auto fu = hn::Add(hn::Mul(hn::Mul(lx, inverse), set(c.fx)), set(c.cx));
        const auto fv = hn::Add(hn::Mul(hn::Mul(ly, inverse), set(c.fy)), set(c.cy));
        const auto lu = hn::NearestInt(fu), lv = hn::NearestInt(fv);
        const auto inside = hn::And(hn::And(hn::Gt(lu, minus_one), hn::Lt(lu, width_i)),
                                    hn::And(hn::Gt(lv, minus_one), hn::Lt(lv, height_i)));
        const auto visible = hn::And(hn::And(is_model, in_front), hn::RebindMask(df, inside));
        if (hn::AllFalse(df, visible)) continue;
        const auto pixel = hn::IfThenElseZero(hn::RebindMask(di, visible), hn::Add(hn::Mul(lv, width_i), lu));
        const auto depth = hn::GatherIndex(df, live, pixel);
        const auto measured = hn::And(visible, hn::Gt(depth, zero));
        // The live point back in the view, exactly at the pixel it was measured at.
        const auto qa = hn::Mul(hn::Mul(hn::Sub(hn::ConvertTo(df, lu), set(c.cx)), set(c.inverse_fx)), depth);
        const auto qb = hn::Mul(hn::Mul(hn::Sub(hn::ConvertTo(df, lv), set(c.cy)), set(c.inverse_fy)), depth);
        const auto to_view = [&](std::size_t i) {
          return hn::Add(hn::Add(hn::Mul(set(c.to_view[i * 4]), qa), hn::Mul(set(c.to_view[i * 4 + 1]), qb)),
                         hn::Add(hn::Mul(set(c.to_view[i * 4 + 2]), depth), set(c.to_view[i * 4 + 3])));
        };
        const auto qx = to_view(0), qy = to_view(1), qz = to_view(2);
        const auto ex = hn::Sub(qx, px), ey = hn::Sub(qy, py), ez = hn::Sub(qz, z);
        const auto gap2 = hn::Add(hn::Add(hn::Mul(ex, ex), hn::Mul(ey, ey)), hn::Mul(ez, ez));
        auto inlier = hn::And(measured, hn::Lt(gap2, set(c.distance2_max)));
        Accumulate(acc, kRowInliers, lane, hn::IfThenElseZero(inlier, one));
        Accumulate(acc, kRowCandidates, lane, hn::IfThenElseZero(measured, one));
        Accumulate(acc, kRowModel, lane, hn::IfThenElseZero(visible, one));
        if (hn::AllFalse(df, inlier)) continue;
        if (live_luma != nullptr)
          AccumulateBrightness(c, model_brightness, live_luma, width, model.camera.height, at, px, py, z, fu, fv,
                               qx, qy, qz, inlier, lane, acc);
        const auto nx = hn::GatherIndex(df, model.nx.data(), at);
        const auto ny = hn::GatherIndex(df, model.ny.data(), at);
        const auto nz = hn::GatherIndex(df, model.nz.data(), at);
        inlier = hn::And(inlier, hn::Lt(nz, zero));  // a cleared normal: known surface, but not smooth
        const auto r = hn::Add(hn::Add(hn::Mul(nx, ex), hn::Mul(ny, ey)), hn::Mul(nz, ez));
        // Huber's weight, at the measurement's noise.
        const auto off = hn::Sub(depth, set(0.4f));
        const auto sigma = hn::Add(set(IcpConstants::kSigmaBaseM),
                                   hn::Mul(set(IcpConstants::kSigmaSlope), hn::Mul(off, off)));
        const auto limit = hn::Mul(set(IcpConstants::kHuberSigmas), sigma);
        const auto size = hn::Abs(r);
        const auto huber = hn::IfThenElse(hn::Gt(size, limit), hn::Div(limit, hn::Max(size, limit)), one);
        const auto w = hn::IfThenElseZero(inlier, huber);
        const auto cz = hn::Sub(qz, set(c.pivot_z));
        const VF j[6] = {hn::Sub(hn::Mul(qy, nz), hn::Mul(cz, ny)),
                         hn::Sub(hn::Mul(cz, nx), hn::Mul(qx, nz)),
                         hn::Sub(hn::Mul(qx, ny), hn::Mul(qy, nx)),
                         nx,
                         ny,
                         nz};
        const auto wr = hn::Mul(w, r);
        AccumulatePlane(acc, lane, j, w, wr);
        Accumulate(acc, kRowResidual2, lane, hn::Mul(wr, r));
        Accumulate(acc, kRowWeight, lane, w);
      }
    }
  }
}

}  // namespace tactus::track::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tactus::track {
HWY_EXPORT(IcpChunk);

int icp_chunks_count(const map::ModelView& model, int stride) {
  const int rows = (model.camera.height + stride - 1) / stride;
  return (rows + kIcpRowsPerChunk - 1) / kIcpRowsPerChunk;
}

IcpSums icp_accumulate(const IcpInput& input, const T_ViewLive& T_view_live, const IcpLevel& level,
                       int chunk) noexcept {
  const IcpConstants constants(input, T_view_live, level);
  alignas(64) float acc[kRowsCount][kVirtualLanes] = {};
  const int row_begin = chunk * kIcpRowsPerChunk * level.stride;
  const int row_end = std::min(input.model->camera.height, row_begin + kIcpRowsPerChunk * level.stride);
  HWY_DYNAMIC_DISPATCH(IcpChunk)
  (constants, *input.model, input.live_m.data(), input.model_brightness.data(),
   input.model_brightness.empty() || input.live_luma.empty() ? nullptr : input.live_luma.data(), level.stride,
   row_begin, row_end, acc);
  const auto fold = [&](std::size_t row) {
    double sum = 0;
    for (const float lane : acc[row]) sum += static_cast<double>(lane);
    return sum;
  };
  IcpSums sums;
  for (std::size_t i = 0; i < 21; ++i) sums.h[i] = fold(i);
  for (std::size_t i = 0; i < 6; ++i) sums.b[i] = fold(kRowB + i);
  sums.weighted_residual2 = fold(kRowResidual2);
  sums.weight = fold(kRowWeight);
  sums.inliers_count = fold(kRowInliers);
  sums.candidates_count = fold(kRowCandidates);
  sums.model_count = fold(kRowModel);
  return sums;
}

}  // namespace tactus::track
#endif
