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

// kReciprocalScale / x.
template <class D, class V>
HWY_INLINE V ScaledReciprocal(D df, V x) {
  const hn::RebindToUnsigned<D> du;
  auto r = hn::BitCast(df, hn::Sub(hn::Set(du, kReciprocalGuess), hn::BitCast(du, x)));
  for (const float a : kReciprocalSteps) r = hn::Mul(r, hn::Sub(hn::Set(df, a), hn::Mul(x, r)));
  return r;
}

// Nearest integer, half to even, of |x| < 2^22: adding 1.5 * 2^23 leaves it in the low bits of the sum. A conversion
// would check for overflow, which is four operations more.
constexpr float kRounder = 12582912.0f;
constexpr std::int32_t kRounderBits = 0x4B400000;

template <class D, class V>
HWY_INLINE auto RoundToInteger(D df, V x) {
  const hn::RebindToSigned<D> di;
  return hn::Sub(hn::BitCast(di, hn::Add(x, hn::Set(df, kRounder))), hn::Set(di, kRounderBits));
}

// Where one group of lattice points projects to.
template <class V>
struct Projected {
  V u, v;           // nearest pixel, perhaps outside: whole numbers
  V beside, below;  // from its centre to the exact place
};

template <class D, class V>
HWY_INLINE auto Project(D df, const IntegrationConstants& c, V x, V y, V inverse_z) {
  const auto rounder = hn::Set(df, kRounder);
  const auto u = hn::Add(hn::Mul(x, inverse_z), hn::Set(df, c.cx));
  const auto v = hn::Add(hn::Mul(y, inverse_z), hn::Set(df, c.cy));
  const auto column = hn::Sub(hn::Add(u, rounder), rounder), row = hn::Sub(hn::Add(v, rounder), rounder);
  return Projected<V>{column, row, hn::Sub(u, column), hn::Sub(v, row)};
}

// 1 / z of cell centres, and of the voxels around them by one Newton step from there.
template <class D, class V>
HWY_INLINE V InverseOf(D df, V cell_z) {
  return hn::Mul(ScaledReciprocal(df, cell_z), hn::Set(df, 1.0f / kReciprocalScale));
}
template <class D, class V>
HWY_INLINE V InverseNear(D df, V cell_inverse, V z) {
  return hn::Mul(cell_inverse, hn::Sub(hn::Set(df, 2.0f), hn::Mul(z, cell_inverse)));
}

// Index of a pixel in an image of up to 2^22 pixels.
template <class D, class V>
HWY_INLINE auto PixelIndex(D df, V u, V v, float width) {
  return RoundToInteger(df, hn::Add(hn::Mul(v, hn::Set(df, width)), u));
}

// Tile words where the points project to; of the nearest tile when that is outside.
template <class D, class P>
HWY_INLINE auto Tiles(D df, const IntegrationConstants& c, const P& p) {
  const hn::RebindToSigned<D> di;
  // Comparison first: it turns the NaN of a point in the camera's plane into 0.
  const auto clamped = [&](auto x, std::int32_t count) {
    const auto low = hn::IfThenElseZero(hn::Gt(x, hn::Zero(df)), x);
    return hn::ConvertTo(di, hn::Min(low, hn::Set(df, static_cast<float>(count - 1))));
  };
  const auto row = hn::Mul(hn::ShiftRight<2>(clamped(p.v, c.height)), hn::Set(di, c.width / 4));
  const auto index = hn::Add(row, hn::ShiftRight<2>(clamped(p.u, c.width)));
  // 16-bit tiles through a 32-bit gather.
  return hn::GatherOffset(di, reinterpret_cast<const std::int32_t*>(c.tiles), hn::ShiftLeft<1>(index));
}

template <class D, class VI>
HWY_INLINE auto CosineOf(D df, const IntegrationConstants& c, VI tile) {
  const hn::RebindToSigned<D> di;
  const auto cosine = hn::ConvertTo(df, hn::And(tile, hn::Set(di, 0xFF)));
  return hn::Mul(cosine, hn::Set(df, c.cosine_to_steps));
}

template <class V, class M>
struct Measured {
  V distance;  // from the measured tangent plane, TSDF steps
  M hit;
};

// Where writing begins, in TSDF steps: a little behind the surface.
template <class D, class V>
HWY_INLINE V BehindOf(D df, const IntegrationConstants& c, V z) {
  const auto off = hn::Sub(z, hn::Set(df, 0.4f / kDepthUnitM));
  const auto noise = hn::Add(hn::Set(df, c.sigma_base), hn::Mul(hn::Set(df, c.sigma_slope), hn::Mul(off, off)));
  return hn::Neg(hn::Min(hn::Max(hn::Set(df, c.behind_min), noise), hn::Set(df, kTsdfScale)));
}

template <class D, class V, class P>
HWY_INLINE auto Inside(D df, const IntegrationConstants& c, const P& p, V z) {
  const auto low = hn::And(hn::Ge(p.u, hn::Zero(df)), hn::Ge(p.v, hn::Zero(df)));
  const auto high = hn::And(hn::Lt(p.u, hn::Set(df, static_cast<float>(c.width))),
                            hn::Lt(p.v, hn::Set(df, static_cast<float>(c.height))));
  return hn::And(hn::And(low, high), hn::Gt(z, hn::Set(df, IntegrationConstants::kNear)));
}

// kInside: all points are known to project into the image.
template <bool kInside, class D, class V, class P>
HWY_INLINE auto Measure(D df, const IntegrationConstants& c, const P& p, V z, V cosine, V behind) {
  const hn::RebindToSigned<D> di;
  const hn::RebindToUnsigned<D> du;
  const auto pixel = [&] {
    if constexpr (kInside) {
      return hn::GatherIndex(du, c.pixels, PixelIndex(df, p.u, p.v, c.row_pixels));
    } else {
      const auto inside = Inside(df, c, p, z);
      const auto index =
          PixelIndex(df, hn::IfThenElseZero(inside, p.u), hn::IfThenElseZero(inside, p.v), c.row_pixels);
      return hn::IfThenElseZero(hn::RebindMask(du, inside), hn::GatherIndex(du, c.pixels, index));
    }
  }();
  const auto depth = hn::ConvertTo(df, hn::BitCast(di, hn::And(pixel, hn::Set(du, 0xFFFFu))));
  const auto slope_u = hn::ConvertTo(df, hn::ShiftRight<24>(hn::BitCast(di, hn::ShiftLeft<8>(pixel))));
  const auto slope_v = hn::ConvertTo(df, hn::ShiftRight<24>(hn::BitCast(di, pixel)));
  const auto here = hn::Add(hn::Add(depth, hn::Mul(slope_u, p.beside)), hn::Mul(slope_v, p.below));
  const auto distance = hn::Mul(hn::Sub(here, z), cosine);
  const auto hit = hn::And(hn::Gt(depth, hn::Zero(df)), hn::Gt(distance, behind));
  return Measured<V, hn::Mask<D>>{distance, hit};
}

// What is looked up once for a cell's eight voxels, written out for the 8x8 voxels of one slice.
struct SliceTiles {
  alignas(64) float inverse_z[64], cosine[64], share[64], behind[64];  // share: weight / kReciprocalScale
  alignas(64) std::int32_t weight[64];
};

constexpr std::size_t kLanes = hn::MaxLanes(F());

// Cells from cell `i` of a slice on, one vector of them, to their voxels in a slice of 64: a row of 4 cells is two rows
// of 8 voxels.
#if HWY_TARGET == HWY_SCALAR
template <class D, class V>
HWY_INLINE void Spread(D, V cell, std::size_t i, hn::TFromD<D>* HWY_RESTRICT voxels) {
  const std::size_t first = i / 4 * 16 + i % 4 * 2;
  for (const std::size_t voxel : {first, first + 1, first + 8, first + 9}) voxels[voxel] = hn::GetLane(cell);
}
#else
constexpr std::size_t kVectorsPerCellRow = 16 / kLanes;
struct SpreadLanes {
  alignas(64) std::int32_t cell[kLanes / 4][kVectorsPerCellRow][kLanes];
};
constexpr SpreadLanes kSpread = [] {
  SpreadLanes out{};
  for (std::size_t row = 0; row < kLanes / 4; ++row)
    for (std::size_t k = 0; k < kVectorsPerCellRow; ++k)
      for (std::size_t lane = 0; lane < kLanes; ++lane)
        out.cell[row][k][lane] = static_cast<std::int32_t>(row * 4 + (k * kLanes + lane) % 8 / 2);
  return out;
}();

template <class D, class V>
HWY_INLINE void Spread(D d, V cells, std::size_t i, hn::TFromD<D>* HWY_RESTRICT voxels) {
  for (std::size_t row = 0; row < kLanes / 4; ++row)
    for (std::size_t k = 0; k < kVectorsPerCellRow; ++k)
      hn::Store(hn::TableLookupLanes(cells, hn::SetTableIndices(d, kSpread.cell[row][k])), d,
                voxels + i * 4 + row * 16 + k * kLanes);
}
#endif

// A tile's four pixels are wider than a cell up to 2 m, and what it says changes slowly: one look-up serves eight voxels.
HWY_INLINE void LookUpTiles(const IntegrationConstants& c, const BlockOrigin& origin, int cell_z, SliceTiles& out) {
  const F df;
  const hn::RebindToSigned<F> di;
  const Vec3f row = origin.cell_slice(c, cell_z);
  for (std::size_t i = 0; i < 16; i += kLanes) {
    const auto point_z = hn::Add(hn::Set(df, row.z), hn::Load(df, c.cell_offset_z + i));
    const auto inverse_z = InverseOf(df, point_z);
    const auto p = Project(df, c, hn::Add(hn::Set(df, row.x), hn::Load(df, c.cell_offset_x + i)),
                           hn::Add(hn::Set(df, row.y), hn::Load(df, c.cell_offset_y + i)), inverse_z);
    const auto tile = Tiles(df, c, p);
    const auto weight = hn::And(hn::ShiftRight<8>(tile), hn::Set(di, 0xFF));
    Spread(df, inverse_z, i, out.inverse_z);
    Spread(df, CosineOf(df, c, tile), i, out.cosine);
    Spread(df, hn::Mul(hn::ConvertTo(df, weight), hn::Set(df, 1.0f / kReciprocalScale)), i, out.share);
    Spread(df, BehindOf(df, c, point_z), i, out.behind);
    Spread(di, weight, i, out.weight);
  }
}

template <bool kInside>
bool IntegrateVoxels(const Map& map, BlockIndex block, const IntegrationConstants& c, const BlockOrigin& origin,
                     BlockStaging& staging) {
  const F df;
  const hn::RebindToSigned<F> di;
  const hn::Rebind<std::int16_t, F> d16;
  const hn::Rebind<std::uint8_t, F> d8;
  const std::int16_t* HWY_RESTRICT tsdf = map.tsdf(block);
  const std::uint8_t* HWY_RESTRICT weight = map.weight(block);
  auto any_hit = hn::Lt(hn::Zero(df), hn::Zero(df));
  SliceTiles tiles;
  for (int z = 0; z < kBlockSide; ++z) {
    if (z % kCellSide == 0) LookUpTiles(c, origin, z / kCellSide, tiles);
    const Vec3f row = origin.slice(c, z);
    const auto row_x = hn::Set(df, row.x), row_y = hn::Set(df, row.y), row_z = hn::Set(df, row.z);
    for (std::size_t i = 0; i < 64; i += kLanes) {
      const std::size_t voxel = static_cast<std::size_t>(z) * 64 + i;
      const auto point_z = hn::Add(row_z, hn::Load(df, c.offset_z + i));
      const auto p = Project(df, c, hn::Add(row_x, hn::Load(df, c.offset_x + i)),
                             hn::Add(row_y, hn::Load(df, c.offset_y + i)),
                             InverseNear(df, hn::Load(df, tiles.inverse_z + i), point_z));
      const auto m =
          Measure<kInside>(df, c, p, point_z, hn::Load(df, tiles.cosine + i), hn::Load(df, tiles.behind + i));
      // No branch on it: which groups are hit is hard to predict, and a wrong guess waits for the whole chain above.
      any_hit = hn::Or(any_hit, m.hit);
      const auto old_i = hn::PromoteTo(di, hn::Load(d16, tsdf + voxel));
      const auto old_weight = hn::PromoteTo(di, hn::Load(d8, weight + voxel));
      const auto sum = hn::Add(old_weight, hn::Load(di, tiles.weight + i));
      const auto old_value = hn::ConvertTo(df, old_i);
      const auto value = hn::Min(m.distance, hn::Set(df, kTsdfScale));
      const auto share = hn::Mul(hn::Load(df, tiles.share + i), ScaledReciprocal(df, hn::ConvertTo(df, sum)));
      const auto mean = hn::Add(old_value, hn::Mul(hn::Sub(value, old_value), share));
      const auto hit_i = hn::RebindMask(di, m.hit);
      // Demoting saturates: weights at 255, a mean that rounds to 32768 at 32767.
      hn::Store(hn::DemoteTo(d16, hn::IfThenElse(hit_i, RoundToInteger(df, mean), old_i)), d16,
                staging.tsdf + voxel);
      hn::Store(hn::DemoteTo(d8, hn::IfThenElse(hit_i, sum, old_weight)), d8, staging.weight + voxel);
    }
  }
  return !hn::AllFalse(df, any_hit);
}

void IntegrateColors(const Map& map, BlockIndex block, const IntegrationConstants& c, const BlockOrigin& origin,
                     BlockStaging& staging) {
  const F df;
  const hn::RebindToSigned<F> di;
  const hn::RebindToUnsigned<F> du;
  const auto* old_colors = reinterpret_cast<const std::uint32_t*>(map.color(block));
  auto* new_colors = reinterpret_cast<std::uint32_t*>(staging.color);
  const auto byte = hn::Set(du, 0xFFu);
  const auto as_float = [&](auto word) { return hn::ConvertTo(df, hn::BitCast(di, word)); };
  for (int z = 0; z < kBlockCellSide; ++z) {
    const Vec3f row = origin.cell_slice(c, z);
    for (std::size_t i = 0; i < 16; i += kLanes) {
      const std::size_t cell = static_cast<std::size_t>(z) * 16 + i;
      const auto point_z = hn::Add(hn::Set(df, row.z), hn::Load(df, c.cell_offset_z + i));
      const auto p = Project(df, c, hn::Add(hn::Set(df, row.x), hn::Load(df, c.cell_offset_x + i)),
                             hn::Add(hn::Set(df, row.y), hn::Load(df, c.cell_offset_y + i)), InverseOf(df, point_z));
      const auto m = Measure<false>(df, c, p, point_z, CosineOf(df, c, Tiles(df, c, p)), BehindOf(df, c, point_z));
      const auto old = hn::Load(du, old_colors + cell);
      const auto near = hn::Lt(hn::Abs(m.distance), hn::Set(df, c.color_band));
      auto hit = hn::RebindMask(di, hn::And(m.hit, near));
      const auto half_of = [&](auto x) { return hn::ShiftRight<1>(hn::ConvertTo(di, hn::IfThenElseZero(m.hit, x))); };
      const auto half = hn::Add(hn::Mul(half_of(p.v), hn::Set(di, c.width / 2)), half_of(p.u));
      const auto seen = hn::GatherIndex(du, c.half_color, half);
      hit = hn::And(hit, hn::RebindMask(di, hn::Gt(hn::BitCast(di, hn::ShiftRight<24>(seen)), hn::Zero(di))));
      const auto old_weight = as_float(hn::ShiftRight<24>(old));
      const auto sum = hn::Add(old_weight, hn::Set(df, 1.0f));
      const auto share = hn::Mul(ScaledReciprocal(df, sum), hn::Set(df, 1.0f / kReciprocalScale));
      const auto blend = [&](auto from, auto to) {
        const auto old_value = as_float(from);
        const auto mean = hn::Add(old_value, hn::Mul(hn::Sub(as_float(to), old_value), share));
        return hn::BitCast(du, RoundToInteger(df, mean));
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
    if (!c.voxels_due(map, block)) continue;
    const BlockOrigin origin = c.origin_of(map.key(block));
    const bool any_hit = origin.is_inside(c) ? IntegrateVoxels<true>(map, block, c, origin, staging)
                                             : IntegrateVoxels<false>(map, block, c, origin, staging);
    if (!any_hit) continue;
    const bool with_color = c.colors_due(map, block);
    if (with_color) IntegrateColors(map, block, c, origin, staging);
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
