#include "pipeline/register/depth_images.hpp"

#include <cmath>
#include <cstring>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/register/depth_images.cpp"
#include "hwy/foreach_target.h"
// clang-format off
#include "hwy/highway.h"
// clang-format on
#include "rt/assert.hpp"

#ifndef TACTUS_REGISTER_TILE_ROW
#define TACTUS_REGISTER_TILE_ROW  // this file is compiled once per instruction set
namespace tactus {

/// A row of tiles: mean depths with one readable float before and after, and its camera.
struct TileRow {
  const float *middle, *up, *down;
  float down_pixels;  // between the centres of up and down
  float fx, fy, cx, v, sigma_at_one;
};

}  // namespace tactus
#endif

HWY_BEFORE_NAMESPACE();
namespace tactus::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// depth_sigma_m(), in its order of operations.
template <class D, class V>
HWY_INLINE V Sigma(D df, V z) {
  const auto off = hn::Sub(z, hn::Set(df, 0.4f));
  return hn::Add(hn::Set(df, 0.0012f), hn::Mul(hn::Mul(hn::Set(df, 0.0019f), off), off));
}

std::uint32_t NormalizeDepth(const std::uint16_t* HWY_RESTRICT raw, std::size_t count, float units,
                             float limit, std::uint16_t* HWY_RESTRICT depth) {
  const hn::ScalableTag<float> df;
  const hn::RebindToSigned<decltype(df)> di;
  const hn::Rebind<std::uint16_t, decltype(df)> d16;
  const std::size_t lanes = hn::Lanes(df);
  const auto scale = hn::Set(df, units);
  const auto max = hn::Set(df, limit);
  std::uint32_t valid = 0;
  std::size_t i = 0;
  for (; i + lanes <= count; i += lanes) {
    const auto value = hn::Mul(hn::ConvertTo(df, hn::PromoteTo(di, hn::LoadU(d16, raw + i))), scale);
    const auto kept = hn::IfThenElseZero(hn::Le(value, max), value);
    const auto rounded = hn::NearestInt(kept);
    valid += static_cast<std::uint32_t>(hn::CountTrue(di, hn::Gt(rounded, hn::Zero(di))));
    hn::StoreU(hn::DemoteTo(d16, rounded), d16, depth + i);
  }
  for (; i < count; ++i) {
    const float value = static_cast<float>(raw[i]) * units;
    const auto rounded = static_cast<std::uint16_t>(value <= limit ? std::nearbyint(value) : 0.0f);
    valid += rounded > 0;
    depth[i] = rounded;
  }
  return valid;
}

// One row of half-resolution pixels from two rows of full resolution.
void HalfRow(const std::uint16_t* HWY_RESTRICT above, const std::uint16_t* HWY_RESTRICT below,
             std::size_t count, float* HWY_RESTRICT out) {
  const hn::CappedTag<float, 16> df;
  const hn::RebindToUnsigned<decltype(df)> du;
  const hn::RebindToSigned<decltype(df)> di;
  const std::size_t lanes = hn::Lanes(df);
  const auto low = hn::Set(du, 0xFFFFu);
  const auto one = hn::Set(df, 1.0f);
  const auto big = hn::Set(df, 1e9f);
  const auto unit = hn::Set(df, kDepthUnitM);
  const auto as_float = [&](auto v) { return hn::ConvertTo(df, hn::BitCast(di, v)); };
  const auto step = [&](std::size_t i) {
    const auto a = hn::LoadU(du, reinterpret_cast<const std::uint32_t*>(above) + i);
    const auto b = hn::LoadU(du, reinterpret_cast<const std::uint32_t*>(below) + i);
    const decltype(one) v[4] = {as_float(hn::And(a, low)), as_float(hn::ShiftRight<16>(a)),
                                as_float(hn::And(b, low)), as_float(hn::ShiftRight<16>(b))};
    auto sum = hn::Zero(df), count_valid = hn::Zero(df), max = hn::Zero(df), min = big;
    for (const auto& value : v) {
      const auto valid = hn::Gt(value, hn::Zero(df));
      sum = hn::Add(sum, value);
      count_valid = hn::Add(count_valid, hn::IfThenElseZero(valid, one));
      max = hn::Max(max, value);
      min = hn::Min(min, hn::IfThenElse(valid, value, big));
    }
    const auto any = hn::Gt(count_valid, hn::Zero(df));
    const auto mean = hn::Mul(hn::Div(sum, hn::Max(count_valid, one)), unit);
    const auto off = hn::Sub(mean, hn::Set(df, 0.4f));
    const auto sigma = hn::Add(hn::Set(df, 0.0012f), hn::Mul(hn::Set(df, 0.0019f), hn::Mul(off, off)));
    const auto spread_max = hn::Add(hn::Set(df, 0.01f), hn::Mul(hn::Set(df, 6.0f), sigma));
    const auto smooth = hn::Le(hn::Mul(hn::Sub(max, min), unit), spread_max);
    return hn::IfThenElseZero(hn::And(any, smooth), mean);
  };
  std::size_t i = 0;
  for (; i + lanes <= count; i += lanes) hn::StoreU(step(i), df, out + i);
  if (i < count && count >= lanes) hn::StoreU(step(count - lanes), df, out + count - lanes);
}

// Mean depth of each tile's valid half-resolution pixels; 0 where fewer than two, or where they straddle an edge.
void TileMeansRow(const float* HWY_RESTRICT above, const float* HWY_RESTRICT below, std::size_t count,
                  float* HWY_RESTRICT means) {
  const hn::CappedTag<float, 16> df;
  const std::size_t lanes = hn::Lanes(df);
  const auto zero = hn::Zero(df), one = hn::Set(df, 1.0f), big = hn::Set(df, 1e9f);
  for (std::size_t at = 0; at < count; at += lanes) {
    const std::size_t i = at + lanes <= count ? at : count - lanes;
    hn::Vec<decltype(df)> z[4];
    hn::LoadInterleaved2(df, above + 2 * i, z[0], z[1]);
    hn::LoadInterleaved2(df, below + 2 * i, z[2], z[3]);
    auto sum = zero, valid_count = zero, max = zero, min = big;
    for (const auto& value : z) {
      const auto valid = hn::Gt(value, zero);
      sum = hn::Add(sum, value);
      valid_count = hn::Add(valid_count, hn::IfThenElseZero(valid, one));
      max = hn::Max(max, value);
      min = hn::Min(min, hn::IfThenElse(valid, value, big));
    }
    const auto mean =
        hn::IfThenElseZero(hn::Gt(valid_count, one), hn::Div(sum, hn::Max(valid_count, one)));
    const auto spread_max = hn::Add(hn::Set(df, 0.02f), hn::Mul(hn::Set(df, 4.0f), Sigma(df, mean)));
    hn::StoreU(hn::IfThenElseZero(hn::Le(hn::Sub(max, min), spread_max), mean), df, means + i);
  }
}

// Tile words and slopes of one row of tiles, from its mean depths and those of the rows above and below.
void TilesRow(const TileRow& row, std::size_t count, std::uint16_t* HWY_RESTRICT tiles,
              std::uint16_t* HWY_RESTRICT slopes) {
  const hn::CappedTag<float, 16> df;
  const hn::RebindToSigned<decltype(df)> di;
  const hn::Rebind<std::uint16_t, decltype(df)> d16;
  const std::size_t lanes = hn::Lanes(df);
  const auto set = [&](float v) { return hn::Set(df, v); };
  const auto zero = hn::Zero(df), one = set(1.0f);
  const auto clamped = [&](auto v, float low, float high) { return hn::Min(hn::Max(v, set(low)), set(high)); };
  for (std::size_t at = 0; at < count; at += lanes) {
    const std::size_t i = at + lanes <= count ? at : count - lanes;
    const auto z = hn::LoadU(df, row.middle + i);
    // The outermost tiles have one neighbour only along the row, one tile away instead of two.
    const auto column = hn::Iota(df, static_cast<float>(i));
    const auto is_first = hn::Eq(column, zero), is_last = hn::Eq(column, set(static_cast<float>(count - 1)));
    const auto left = hn::IfThenElse(is_first, z, hn::LoadU(df, row.middle + i - 1));
    const auto right = hn::IfThenElse(is_last, z, hn::LoadU(df, row.middle + i + 1));
    const auto up = hn::LoadU(df, row.up + i), down = hn::LoadU(df, row.down + i);
    const auto known = hn::And(hn::And(hn::Gt(z, zero), hn::And(hn::Gt(left, zero), hn::Gt(right, zero))),
                               hn::And(hn::Gt(up, zero), hn::Gt(down, zero)));
    const auto across = hn::IfThenElse(hn::Or(is_first, is_last), set(4.0f), set(8.0f));
    // For z(u, v) the plane's normal is (-fx z_u, -fy z_v, z + (u - cx) z_u + (v - cy) z_v), and its product with the ray
    // ((u - cx) / fx, (v - cy) / fy, 1) is z. Where a neighbour is missing or beyond an edge the surface is taken to face
    // the camera, with little weight.
    const auto z_u = hn::IfThenElseZero(known, hn::Div(hn::Sub(right, left), across));
    const auto z_v = hn::IfThenElseZero(known, hn::Div(hn::Sub(down, up), set(row.down_pixels)));
    const auto u = hn::Sub(hn::Add(hn::Mul(set(4.0f), column), set(1.5f)), set(row.cx));
    const auto nx = hn::Mul(set(row.fx), z_u), ny = hn::Mul(set(row.fy), z_v);
    const auto nz = hn::Add(hn::Add(z, hn::Mul(u, z_u)), hn::Mul(set(row.v), z_v));
    const auto norm2 = hn::Add(hn::Add(hn::Mul(nx, nx), hn::Mul(ny, ny)), hn::Mul(nz, nz));
    const auto slant = hn::Div(z, hn::Sqrt(hn::IfThenElse(known, norm2, one)));
    // Below 0.2 (78 degrees) sensors return nothing that can be trusted.
    const auto cosine = clamped(hn::IfThenElse(known, slant, one), 0.2f, 1.27f);
    const auto trust = hn::IfThenElse(known, slant, set(0.25f));
    const auto relative = hn::IfThenElseZero(hn::Gt(z, zero), hn::Div(set(row.sigma_at_one), Sigma(df, z)));
    const auto weight =
        clamped(hn::Mul(hn::Mul(hn::Mul(set(32.0f), relative), relative), trust), 1.0f, 32.0f);
    const auto rounded = [&](auto v) { return hn::ConvertTo(di, hn::Add(v, set(0.5f))); };
    const auto tile = hn::Or(rounded(hn::Mul(cosine, set(200.0f))), hn::ShiftLeft<8>(rounded(weight)));
    hn::StoreU(hn::DemoteTo(d16, tile), d16, tiles + i);
    const auto signed_byte = [&](auto slope) {
      const auto units = clamped(hn::Div(slope, set(kSlopeUnitM)), -127.0f, 127.0f);
      return hn::And(hn::NearestInt(units), hn::Set(di, 0xFF));
    };
    const auto packed = hn::Or(signed_byte(z_u), hn::ShiftLeft<8>(signed_byte(z_v)));
    alignas(64) std::uint16_t one_each[16];
    hn::Store(hn::DemoteTo(d16, packed), d16, one_each);
    for (std::size_t lane = 0; lane < lanes; ++lane) {
      const std::uint64_t four = one_each[lane] * 0x0001'0001'0001'0001ull;
      std::memcpy(slopes + 4 * (i + lane), &four, sizeof four);
    }
  }
}

void PackRow(const std::uint16_t* HWY_RESTRICT depth, const std::uint16_t* HWY_RESTRICT upper,
             std::size_t count, std::uint32_t* HWY_RESTRICT out) {
  const hn::ScalableTag<std::uint32_t> du;
  const hn::Rebind<std::uint16_t, decltype(du)> d16;
  const std::size_t lanes = hn::Lanes(du);
  std::size_t i = 0;
  for (; i + lanes <= count; i += lanes) {
    const auto low = hn::PromoteTo(du, hn::LoadU(d16, depth + i));
    const auto high = hn::ShiftLeft<16>(hn::PromoteTo(du, hn::LoadU(d16, upper + i)));
    hn::StoreU(hn::Or(low, high), du, out + i);
  }
  for (; i < count; ++i) out[i] = depth[i] | static_cast<std::uint32_t>(upper[i]) << 16;
}

}  // namespace tactus::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tactus {
HWY_EXPORT(NormalizeDepth);
HWY_EXPORT(HalfRow);
HWY_EXPORT(TileMeansRow);
HWY_EXPORT(TilesRow);
HWY_EXPORT(PackRow);

hal::Intrinsics half_resolution(const hal::Intrinsics& full) {
  hal::Intrinsics half = full;
  half.width = full.width / 2;
  half.height = full.height / 2;
  half.fx = full.fx / 2;
  half.fy = full.fy / 2;
  half.cx = (full.cx - 0.5) / 2;
  half.cy = (full.cy - 0.5) / 2;
  return half;
}

std::uint32_t normalize_depth(std::span<const std::uint16_t> raw, double depth_m_per_unit, float depth_m_max,
                              std::span<std::uint16_t> depth) noexcept {
  TACTUS_ASSERT(raw.size() == depth.size());
  const auto units = static_cast<float>(depth_m_per_unit / static_cast<double>(kDepthUnitM));
  const float limit = std::fmin(65535.0f, depth_m_max / kDepthUnitM);
  return HWY_DYNAMIC_DISPATCH(NormalizeDepth)(raw.data(), raw.size(), units, limit, depth.data());
}

void half_depth(std::span<const std::uint16_t> depth, int width, int height,
                std::span<float> half_m) noexcept {
  const auto w = static_cast<std::size_t>(width), h = static_cast<std::size_t>(height);
  TACTUS_ASSERT(w % 2 == 0 && h % 2 == 0 && w >= 32 && depth.size() == w * h && half_m.size() == w * h / 4);
  for (std::size_t y = 0; y < h / 2; ++y) {
    const std::uint16_t* row = depth.data() + 2 * y * w;
    HWY_DYNAMIC_DISPATCH(HalfRow)(row, row + w, w / 2, half_m.data() + y * (w / 2));
  }
}

void tile_means(std::span<const float> half_m, const hal::Intrinsics& full, std::span<float> means_m) noexcept {
  const auto width = static_cast<std::size_t>(full.width);
  const std::size_t tiles_x = width / 4;
  TACTUS_ASSERT(width % 4 == 0 && tiles_x >= 16 && means_m.size() == tiles_count(full.width, full.height) &&
                half_m.size() == 4 * means_m.size());
  for (std::size_t first = 0; first < means_m.size(); first += tiles_x) {
    const float* half_row = &half_m[4 * first];
    HWY_DYNAMIC_DISPATCH(TileMeansRow)(half_row, half_row + width / 2, tiles_x, &means_m[first]);
  }
}

void integration_image(std::span<const std::uint16_t> depth, std::span<const float> half_m,
                       const hal::Intrinsics& full, std::span<float> tile_scratch,
                       const IntegrationImage& image) noexcept {
  const auto width = static_cast<std::size_t>(full.width), height = static_cast<std::size_t>(full.height);
  const std::size_t tiles_x = width / 4, tiles_y = height / 4;
  TACTUS_ASSERT(width % 4 == 0 && tiles_x >= 16 &&
                tile_scratch.size() >= tile_scratch_count(full.width, full.height) &&
                image.pixels.size() == depth.size() && image.tiles.size() > tiles_count(full.width, full.height));
  float* means = tile_scratch.data() + 1;  // the float before belongs to the first tile's left neighbour
  tile_means(half_m, full, {means, tiles_x * tiles_y});
  // The scratch's tail holds one row of slopes at full resolution.
  auto* slopes = reinterpret_cast<std::uint16_t*>(means + tiles_x * tiles_y + 1);
  for (std::size_t ty = 0; ty < tiles_y; ++ty) {
    const std::size_t y0 = ty > 0 ? ty - 1 : ty, y1 = ty + 1 < tiles_y ? ty + 1 : ty;
    const TileRow row{means + ty * tiles_x,
                      means + y0 * tiles_x,
                      means + y1 * tiles_x,
                      static_cast<float>(4 * (y1 - y0)),
                      static_cast<float>(full.fx),
                      static_cast<float>(full.fy),
                      static_cast<float>(full.cx),
                      static_cast<float>(4 * ty) + 1.5f - static_cast<float>(full.cy),
                      depth_sigma_m(1.0f)};
    HWY_DYNAMIC_DISPATCH(TilesRow)(row, tiles_x, &image.tiles[ty * tiles_x], slopes);
    for (std::size_t y = 4 * ty; y < 4 * ty + 4; ++y)
      HWY_DYNAMIC_DISPATCH(PackRow)(&depth[y * width], slopes, width, &image.pixels[y * width]);
  }
}

}  // namespace tactus
#endif
