#include "pipeline/map/integrate.hpp"

#include <cmath>
#include <cstring>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/map/integrate.cpp"
#include "hwy/foreach_target.h"
// clang-format off
#include "hwy/highway.h"
// clang-format on
#include "pipeline/map/integrate_constants.hpp"
#include "pipeline/map/reciprocal.hpp"
#include "pipeline/register/depth_images.hpp"
#include "rt/assert.hpp"

HWY_BEFORE_NAMESPACE();
namespace tactus::map::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// At most 16 lanes: two rows of a block.
using F = hn::CappedTag<float, 16>;

template <class D, class V>
HWY_INLINE V Reciprocal(D df, V x) {
  const hn::RebindToUnsigned<D> du;
  const auto two = hn::Set(df, 2.0f);
  auto r = hn::BitCast(df, hn::Sub(hn::Set(du, kReciprocalGuess), hn::BitCast(du, x)));
  for (int step = 0; step < 3; ++step) r = hn::Mul(r, hn::Sub(two, hn::Mul(x, r)));
  return r;
}

// Nearest integer, half to even, of |x| < 2^22: adding 1.5 * 2^23 leaves it in the low bits of the sum. Others give an
// integer below 0 or above 2^22. A conversion would check for overflow, which is four operations more.
constexpr float kRounder = 12582912.0f;
constexpr std::int32_t kRounderBits = 0x4B400000;

template <class V, class VI>
struct Rounded {
  V value;
  VI integer;
};

template <class D, class V>
HWY_INLINE auto Round(D df, V x) {
  const hn::RebindToSigned<D> di;
  const auto sum = hn::Add(x, hn::Set(df, kRounder));
  const auto integer = hn::Sub(hn::BitCast(di, sum), hn::Set(di, kRounderBits));
  return Rounded<V, decltype(integer)>{hn::Sub(sum, hn::Set(df, kRounder)), integer};
}

// Where one group of lattice points projects to.
template <class V, class VI>
struct Projected {
  VI u, v;          // nearest pixel, perhaps outside
  V beside, below;  // from its centre to the exact place
};

template <class D, class V>
HWY_INLINE auto Project(D df, const IntegrationConstants& c, V x, V y, V z) {
  const auto inverse = Reciprocal(df, z);
  const auto u = hn::Add(hn::Mul(x, inverse), hn::Set(df, c.cx));
  const auto v = hn::Add(hn::Mul(y, inverse), hn::Set(df, c.cy));
  const auto column = Round(df, u), row = Round(df, v);
  return Projected<V, hn::Vec<hn::RebindToSigned<D>>>{column.integer, row.integer, hn::Sub(u, column.value),
                                                      hn::Sub(v, row.value)};
}

// Tile words where the points project to; of the nearest tile when that is outside.
template <class D, class P>
HWY_INLINE auto Tiles(D, const IntegrationConstants& c, const P& p) {
  const hn::RebindToSigned<D> di;
  const hn::RebindToUnsigned<D> du;
  const auto clamped = [&](auto v, std::int32_t count) {
    return hn::Min(hn::Max(v, hn::Zero(di)), hn::Set(di, count - 1));
  };
  const auto row = hn::Mul(hn::ShiftRight<2>(clamped(p.v, c.height)), hn::Set(di, c.width / 4));
  const auto index = hn::Add(row, hn::ShiftRight<2>(clamped(p.u, c.width)));
  // 16-bit tiles through a 32-bit gather.
  return hn::GatherOffset(du, reinterpret_cast<const std::uint32_t*>(c.tiles), hn::ShiftLeft<1>(index));
}

template <class D, class VU>
HWY_INLINE auto CosineOf(D df, const IntegrationConstants& c, VU tile) {
  const hn::RebindToSigned<D> di;
  const hn::RebindToUnsigned<D> du;
  const auto cosine = hn::ConvertTo(df, hn::BitCast(di, hn::And(tile, hn::Set(du, 0xFFu))));
  return hn::Mul(cosine, hn::Set(df, c.cosine_to_truncations));
}

template <class V, class M>
struct Measured {
  V distance;  // from the measured tangent plane, in truncations
  M hit;
};

// Where writing begins, in truncations: a little behind the surface.
template <class D, class V>
HWY_INLINE V BehindOf(D df, const IntegrationConstants& c, V z) {
  const auto off = hn::Sub(z, hn::Set(df, 0.4f));
  const auto noise = hn::Add(hn::Set(df, c.sigma_base), hn::Mul(hn::Set(df, c.sigma_slope), hn::Mul(off, off)));
  return hn::Neg(hn::Min(hn::Max(hn::Set(df, c.behind_min), noise), hn::Set(df, 1.0f)));
}

template <class D, class V, class P>
HWY_INLINE auto Measure(D df, const IntegrationConstants& c, const P& p, V z, V cosine, V behind) {
  const hn::RebindToSigned<D> di;
  const hn::RebindToUnsigned<D> du;
  auto inside = hn::And(hn::Lt(hn::BitCast(du, p.u), hn::Set(du, static_cast<std::uint32_t>(c.width))),
                        hn::Lt(hn::BitCast(du, p.v), hn::Set(du, static_cast<std::uint32_t>(c.height))));
  inside = hn::And(inside, hn::RebindMask(du, hn::Gt(z, hn::Set(df, IntegrationConstants::kNearM))));
  const auto index = hn::Add(hn::Mul(p.v, hn::Set(di, c.width)), p.u);
  const auto pixel = hn::GatherIndex(du, c.pixels, hn::IfThenElseZero(hn::RebindMask(di, inside), index));
  const auto depth = hn::ConvertTo(df, hn::BitCast(di, hn::And(pixel, hn::Set(du, 0xFFFFu))));
  const auto slope_u = hn::ConvertTo(df, hn::ShiftRight<24>(hn::BitCast(di, hn::ShiftLeft<8>(pixel))));
  const auto slope_v = hn::ConvertTo(df, hn::ShiftRight<24>(hn::BitCast(di, pixel)));
  const auto here = hn::Add(hn::Add(depth, hn::Mul(slope_u, p.beside)), hn::Mul(slope_v, p.below));
  const auto distance = hn::Mul(hn::Sub(hn::Mul(here, hn::Set(df, kDepthUnitM)), z), cosine);
  const auto hit = hn::And(hn::And(hn::RebindMask(df, inside), hn::Gt(depth, hn::Zero(df))),
                           hn::Gt(distance, behind));
  return Measured<V, decltype(hit)>{distance, hit};
}

// What the tiles say at the cells of two slices of voxels, written out for the 8x8 voxels of one slice.
struct SliceTiles {
  alignas(64) float cosine[64], weight[64], behind[64];
};

// 4x4 cells to 8x8 voxels: a pair of equal floats is one 64-bit word.
HWY_INLINE void WriteOut(const std::uint32_t* HWY_RESTRICT cells, float* HWY_RESTRICT voxels) {
  const hn::CappedTag<std::uint64_t, 8> d64;
  const hn::Rebind<std::uint32_t, decltype(d64)> d32;
  alignas(64) std::uint64_t pairs[16];
  for (std::size_t i = 0; i < 16; i += hn::Lanes(d64)) {
    const auto value = hn::PromoteTo(d64, hn::Load(d32, cells + i));
    hn::Store(hn::Or(value, hn::ShiftLeft<32>(value)), d64, pairs + i);
  }
  for (std::size_t y = 0; y < 8; ++y) std::memcpy(voxels + y * 8, pairs + y / 2 * 4, 8 * sizeof(float));
}

// A tile's four pixels are wider than a cell up to 2 m, and what it says changes slowly: one look-up serves eight voxels.
void LookUpTiles(const IntegrationConstants& c, const BlockOrigin& origin, int cell_z, SliceTiles& out) {
  const F df;
  const hn::RebindToSigned<F> di;
  const hn::RebindToUnsigned<F> du;
  const Vec3f row = origin.cell_slice(c, cell_z);
  alignas(64) std::uint32_t cosines[16], weights[16], behinds[16];
  for (std::size_t i = 0; i < 16; i += hn::Lanes(df)) {
    const auto point_z = hn::Add(hn::Set(df, row.z), hn::Load(df, c.cell_offset_z + i));
    const auto p = Project(df, c, hn::Add(hn::Set(df, row.x), hn::Load(df, c.cell_offset_x + i)),
                           hn::Add(hn::Set(df, row.y), hn::Load(df, c.cell_offset_y + i)), point_z);
    const auto tile = Tiles(df, c, p);
    const auto weight =
        hn::ConvertTo(df, hn::BitCast(di, hn::And(hn::ShiftRight<8>(tile), hn::Set(du, 0xFFu))));
    hn::Store(hn::BitCast(du, CosineOf(df, c, tile)), du, cosines + i);
    hn::Store(hn::BitCast(du, weight), du, weights + i);
    hn::Store(hn::BitCast(du, BehindOf(df, c, point_z)), du, behinds + i);
  }
  WriteOut(cosines, out.cosine);
  WriteOut(weights, out.weight);
  WriteOut(behinds, out.behind);
}

bool IntegrateVoxels(const Map& map, BlockIndex block, const IntegrationConstants& c, BlockStaging& staging) {
  const F df;
  const hn::RebindToSigned<F> di;
  const hn::Rebind<std::int16_t, F> d16;
  const hn::Rebind<std::uint8_t, F> d8;
  const std::size_t lanes = hn::Lanes(df);
  const std::int16_t* HWY_RESTRICT tsdf = map.tsdf(block);
  const std::uint8_t* HWY_RESTRICT weight = map.weight(block);
  const BlockOrigin origin = c.origin_of(map.key(block));
  auto any_hit = hn::Lt(hn::Zero(df), hn::Zero(df));
  SliceTiles tiles;
  for (int z = 0; z < kBlockSide; ++z) {
    if (z % kCellSide == 0) LookUpTiles(c, origin, z / kCellSide, tiles);
    const Vec3f row = origin.slice(c, z);
    const auto row_x = hn::Set(df, row.x), row_y = hn::Set(df, row.y), row_z = hn::Set(df, row.z);
    for (std::size_t i = 0; i < 64; i += lanes) {
      const std::size_t voxel = static_cast<std::size_t>(z) * 64 + i;
      const auto point_z = hn::Add(row_z, hn::Load(df, c.offset_z + i));
      const auto p = Project(df, c, hn::Add(row_x, hn::Load(df, c.offset_x + i)),
                             hn::Add(row_y, hn::Load(df, c.offset_y + i)), point_z);
      const auto m = Measure(df, c, p, point_z, hn::Load(df, tiles.cosine + i), hn::Load(df, tiles.behind + i));
      const auto old16 = hn::Load(d16, tsdf + voxel);
      const auto old8 = hn::Load(d8, weight + voxel);
      // No branch on it: which groups are hit is hard to predict, and a wrong guess waits for the whole chain above.
      any_hit = hn::Or(any_hit, m.hit);
      const auto old_i = hn::PromoteTo(di, old16);
      const auto old_weight_i = hn::PromoteTo(di, old8);
      const auto old_value = hn::ConvertTo(df, old_i);
      const auto old_weight = hn::ConvertTo(df, old_weight_i);
      const auto value = hn::Mul(hn::Min(m.distance, hn::Set(df, 1.0f)), hn::Set(df, kTsdfScale));
      const auto seen_weight = hn::Load(df, tiles.weight + i);
      const auto sum = hn::Add(old_weight, seen_weight);
      const auto mean =
          hn::Mul(hn::Add(hn::Mul(old_value, old_weight), hn::Mul(value, seen_weight)), Reciprocal(df, sum));
      const auto hit_i = hn::RebindMask(di, m.hit);
      const auto new_value = hn::IfThenElse(hit_i, Round(df, mean).integer, old_i);
      const auto new_weight = hn::IfThenElse(
          hit_i, Round(df, hn::Min(sum, hn::Set(df, IntegrationConstants::kWeightMax))).integer, old_weight_i);
      hn::Store(hn::DemoteTo(d16, new_value), d16, staging.tsdf + voxel);
      hn::Store(hn::DemoteTo(d8, new_weight), d8, staging.weight + voxel);
    }
  }
  return !hn::AllFalse(df, any_hit);
}

void IntegrateColors(const Map& map, BlockIndex block, const IntegrationConstants& c, BlockStaging& staging) {
  const F df;
  const hn::RebindToSigned<F> di;
  const hn::RebindToUnsigned<F> du;
  const std::size_t lanes = hn::Lanes(df);
  const auto* old_colors = reinterpret_cast<const std::uint32_t*>(map.color(block));
  auto* new_colors = reinterpret_cast<std::uint32_t*>(staging.color);
  const BlockOrigin origin = c.origin_of(map.key(block));
  const auto byte = hn::Set(du, 0xFFu);
  const auto as_float = [&](auto word) { return hn::ConvertTo(df, hn::BitCast(di, word)); };
  for (int z = 0; z < kBlockCellSide; ++z) {
    const Vec3f row = origin.cell_slice(c, z);
    for (std::size_t i = 0; i < 16; i += lanes) {
      const std::size_t cell = static_cast<std::size_t>(z) * 16 + i;
      const auto point_z = hn::Add(hn::Set(df, row.z), hn::Load(df, c.cell_offset_z + i));
      const auto p = Project(df, c, hn::Add(hn::Set(df, row.x), hn::Load(df, c.cell_offset_x + i)),
                             hn::Add(hn::Set(df, row.y), hn::Load(df, c.cell_offset_y + i)), point_z);
      const auto m = Measure(df, c, p, point_z, CosineOf(df, c, Tiles(df, c, p)), BehindOf(df, c, point_z));
      const auto old = hn::Load(du, old_colors + cell);
      const auto near = hn::Lt(hn::Abs(m.distance), hn::Set(df, c.color_band));
      auto hit = hn::RebindMask(di, hn::And(m.hit, near));
      const auto half = hn::Add(hn::Mul(hn::ShiftRight<1>(p.v), hn::Set(di, c.width / 2)), hn::ShiftRight<1>(p.u));
      const auto seen = hn::GatherIndex(du, c.half_color, hn::IfThenElseZero(hit, half));
      hit = hn::And(hit, hn::RebindMask(di, hn::Gt(hn::BitCast(di, hn::ShiftRight<24>(seen)), hn::Zero(di))));
      const auto old_weight = as_float(hn::ShiftRight<24>(old));
      const auto sum = hn::Add(old_weight, hn::Set(df, 1.0f));
      const auto blend = [&](auto from, auto to) {
        const auto mean = hn::Div(hn::Add(hn::Mul(as_float(from), old_weight), as_float(to)), sum);
        return hn::BitCast(du, hn::NearestInt(mean));
      };
      const auto r = blend(hn::And(old, byte), hn::And(seen, byte));
      const auto g = blend(hn::And(hn::ShiftRight<8>(old), byte), hn::And(hn::ShiftRight<8>(seen), byte));
      const auto b = blend(hn::And(hn::ShiftRight<16>(old), byte), hn::And(hn::ShiftRight<16>(seen), byte));
      const auto w =
          hn::BitCast(du, hn::NearestInt(hn::Min(sum, hn::Set(df, IntegrationConstants::kColorWeightMax))));
      const auto mixed =
          hn::Or(hn::Or(r, hn::ShiftLeft<8>(g)), hn::Or(hn::ShiftLeft<16>(b), hn::ShiftLeft<24>(w)));
      hn::Store(hn::IfThenElse(hn::RebindMask(du, hit), mixed, old), du, new_colors + cell);
    }
  }
}

void IntegrateBlocks(Map& map, const IntegrationConstants& c, std::span<const BlockIndex> blocks) {
  BlockStaging staging;
  for (const BlockIndex block : blocks) {
    if (!c.voxels_due(map, block) || !IntegrateVoxels(map, block, c, staging)) continue;
    const bool with_color = c.colors_due(map, block);
    if (with_color) IntegrateColors(map, block, c, staging);
    map.publish(block, staging, with_color);
  }
}

}  // namespace tactus::map::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tactus::map {
HWY_EXPORT(IntegrateBlocks);

void integrate_blocks(Map& map, const IntegrationFrame& frame, std::span<const BlockIndex> blocks) noexcept {
  const IntegrationConstants constants(map, frame);
  HWY_DYNAMIC_DISPATCH(IntegrateBlocks)(map, constants, blocks);
}

}  // namespace tactus::map
#endif
