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

// acc[i] += value, for the virtual lanes beginning at `lane`.
HWY_INLINE void Accumulate(float (*HWY_RESTRICT acc)[kVirtualLanes], std::size_t i, std::size_t lane,
                           VF value) {
  const F df;
  hn::Store(hn::Add(hn::Load(df, acc[i] + lane), value), df, acc[i] + lane);
}

void IcpChunk(const IcpConstants& c, const map::ModelView& model, const float* HWY_RESTRICT live, int stride,
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
        const auto lu = hn::NearestInt(hn::Add(hn::Mul(hn::Mul(lx, inverse), set(c.fx)), set(c.cx)));
        const auto lv = hn::NearestInt(hn::Add(hn::Mul(hn::Mul(ly, inverse), set(c.fy)), set(c.cy)));
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
        std::size_t k = 0;
        for (std::size_t i = 0; i < 6; ++i) {
          const auto wj = hn::Mul(w, j[i]);
          for (std::size_t l = i; l < 6; ++l) Accumulate(acc, k++, lane, hn::Mul(wj, j[l]));
        }
        for (std::size_t i = 0; i < 6; ++i) Accumulate(acc, kRowB + i, lane, hn::Mul(wr, j[i]));
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
  (constants, *input.model, input.live_m.data(), level.stride, row_begin, row_end, acc);
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
