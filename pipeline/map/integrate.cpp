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
#include "pipeline/register/depth_images.hpp"
#include "rt/assert.hpp"

HWY_BEFORE_NAMESPACE();
namespace tactus::map::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// At most 16 lanes: two rows of a block.
using F = hn::CappedTag<float, 16>;

// What one group of lattice points meets in the image.
template <class V, class VU, class M>
struct Measured {
  V distance;  // from the measured tangent plane, in truncations; > -1 where hit
  V weight;
  VU pixel;  // index in the half-resolution image
  M hit;
};

template <class D, class V>
HWY_INLINE auto Measure(D df, const IntegrationConstants& c, V x, V y, V z) {
  const hn::RebindToSigned<D> di;
  const hn::RebindToUnsigned<D> du;
  const auto one = hn::Set(df, 1.0f);
  const auto inverse = hn::Div(one, z);
  const auto u_exact = hn::Add(hn::Mul(x, inverse), hn::Set(df, c.cx));
  const auto v_exact = hn::Add(hn::Mul(y, inverse), hn::Set(df, c.cy));
  const auto u = hn::NearestInt(u_exact);
  const auto v = hn::NearestInt(v_exact);
  const auto minus_one = hn::Set(di, -1);
  auto inside = hn::And(hn::And(hn::Gt(u, minus_one), hn::Lt(u, hn::Set(di, c.width))),
                        hn::And(hn::Gt(v, minus_one), hn::Lt(v, hn::Set(di, c.height))));
  inside = hn::And(inside, hn::RebindMask(di, hn::Gt(z, hn::Set(df, IntegrationConstants::kNearM))));
  const auto index = hn::IfThenElseZero(inside, hn::Add(hn::Mul(v, hn::Set(di, c.width)), u));
  const auto pixel = hn::GatherIndex(du, c.pixels, index);
  // 16-bit tiles through a 32-bit gather.
  const auto tile_index =
      hn::Add(hn::Mul(hn::ShiftRight<2>(v), hn::Set(di, c.width / 4)), hn::ShiftRight<2>(u));
  const auto tile = hn::GatherOffset(du, reinterpret_cast<const std::uint32_t*>(c.tiles),
                                     hn::IfThenElseZero(inside, hn::ShiftLeft<1>(tile_index)));
  const auto as_float = [&](auto word) { return hn::ConvertTo(df, hn::BitCast(di, word)); };
  const auto byte = hn::Set(du, 0xFFu);
  const auto depth = as_float(hn::And(pixel, hn::Set(du, 0xFFFFu)));
  const auto slope_u = hn::ConvertTo(df, hn::ShiftRight<24>(hn::BitCast(di, hn::ShiftLeft<8>(pixel))));
  const auto slope_v = hn::ConvertTo(df, hn::ShiftRight<24>(hn::BitCast(di, pixel)));
  const auto here = hn::Add(hn::Add(depth, hn::Mul(slope_u, hn::Sub(u_exact, hn::ConvertTo(df, u)))),
                            hn::Mul(slope_v, hn::Sub(v_exact, hn::ConvertTo(df, v))));
  const auto weight = as_float(hn::And(hn::ShiftRight<8>(tile), byte));
  const auto cosine = as_float(hn::And(tile, byte));
  const auto difference = hn::Sub(hn::Mul(here, hn::Set(df, kDepthUnitM)), z);
  const auto distance = hn::Mul(difference, hn::Mul(cosine, hn::Set(df, c.cosine_to_truncations)));
  const auto hit = hn::And(hn::And(hn::RebindMask(df, inside), hn::Gt(depth, hn::Zero(df))),
                           hn::Gt(distance, hn::Set(df, -1.0f)));
  const auto half =
      hn::BitCast(du, hn::Add(hn::Mul(hn::ShiftRight<1>(v), hn::Set(di, c.width / 2)), hn::ShiftRight<1>(u)));
  return Measured<decltype(distance), decltype(half), decltype(hit)>{distance, weight, half, hit};
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
  bool changed = false;
  for (int z = 0; z < kBlockSide; ++z) {
    const Vec3f row = origin.slice(c, z);
    const auto row_x = hn::Set(df, row.x), row_y = hn::Set(df, row.y), row_z = hn::Set(df, row.z);
    for (std::size_t i = 0; i < 64; i += lanes) {
      const std::size_t voxel = static_cast<std::size_t>(z) * 64 + i;
      const auto m =
          Measure(df, c, hn::Add(row_x, hn::Load(df, c.offset_x + i)),
                  hn::Add(row_y, hn::Load(df, c.offset_y + i)), hn::Add(row_z, hn::Load(df, c.offset_z + i)));
      const auto old16 = hn::Load(d16, tsdf + voxel);
      const auto old8 = hn::Load(d8, weight + voxel);
      if (hn::AllFalse(df, m.hit)) {
        hn::Store(old16, d16, staging.tsdf + voxel);
        hn::Store(old8, d8, staging.weight + voxel);
        continue;
      }
      changed = true;
      const auto old_i = hn::PromoteTo(di, old16);
      const auto old_weight_i = hn::PromoteTo(di, old8);
      const auto old_value = hn::ConvertTo(df, old_i);
      const auto old_weight = hn::ConvertTo(df, old_weight_i);
      const auto value = hn::Mul(hn::Min(m.distance, hn::Set(df, 1.0f)), hn::Set(df, kTsdfScale));
      const auto sum = hn::Add(old_weight, m.weight);
      const auto mean = hn::Div(hn::Add(hn::Mul(old_value, old_weight), hn::Mul(value, m.weight)), sum);
      const auto hit_i = hn::RebindMask(di, m.hit);
      const auto new_value = hn::IfThenElse(hit_i, hn::NearestInt(mean), old_i);
      const auto new_weight = hn::IfThenElse(
          hit_i, hn::NearestInt(hn::Min(sum, hn::Set(df, IntegrationConstants::kWeightMax))), old_weight_i);
      hn::Store(hn::DemoteTo(d16, new_value), d16, staging.tsdf + voxel);
      hn::Store(hn::DemoteTo(d8, new_weight), d8, staging.weight + voxel);
    }
  }
  return changed;
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
      const auto m = Measure(df, c, hn::Add(hn::Set(df, row.x), hn::Load(df, c.cell_offset_x + i)),
                             hn::Add(hn::Set(df, row.y), hn::Load(df, c.cell_offset_y + i)),
                             hn::Add(hn::Set(df, row.z), hn::Load(df, c.cell_offset_z + i)));
      const auto old = hn::Load(du, old_colors + cell);
      const auto near = hn::Lt(hn::Abs(m.distance), hn::Set(df, c.color_band));
      auto hit = hn::RebindMask(di, hn::And(m.hit, near));
      const auto seen = hn::GatherIndex(du, c.half_color, hn::IfThenElseZero(hit, hn::BitCast(di, m.pixel)));
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
    if (!IntegrateVoxels(map, block, c, staging)) continue;
    if (c.colors_due(map, block)) {
      IntegrateColors(map, block, c, staging);
    } else {
      std::memcpy(staging.color, map.color(block), sizeof staging.color);
    }
    map.publish(block, staging);
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
