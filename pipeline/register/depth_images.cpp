#include "pipeline/register/depth_images.hpp"

#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/register/depth_images.cpp"
#include "hwy/foreach_target.h"
// clang-format off
#include "hwy/highway.h"
// clang-format on
#include "rt/assert.hpp"

HWY_BEFORE_NAMESPACE();
namespace tactus::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

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

void integration_image(std::span<const std::uint16_t> depth, std::span<const float> half_m,
                       const hal::Intrinsics& full, std::span<float> tile_scratch,
                       const IntegrationImage& image) noexcept {
  const int width = full.width, height = full.height;
  const int half_width = width / 2;
  const int tiles_x = width / 4, tiles_y = height / 4;
  TACTUS_ASSERT(width % 4 == 0 && tile_scratch.size() >= tile_scratch_count(width, height) &&
                image.pixels.size() == depth.size() && image.tiles.size() > tiles_count(width, height));
  // Mean depth of each tile's valid half-resolution pixels; 0 where fewer than two, or where they straddle an
  // edge.
  for (int ty = 0; ty < tiles_y; ++ty)
    for (int tx = 0; tx < tiles_x; ++tx) {
      const float* p = &half_m[static_cast<std::size_t>(2 * ty * half_width + 2 * tx)];
      const float z[4] = {p[0], p[1], p[half_width], p[half_width + 1]};
      float sum = 0, min = 1e9f, max = 0;
      int count = 0;
      for (float v : z)
        if (v > 0) {
          sum += v;
          min = v < min ? v : min;
          max = v > max ? v : max;
          ++count;
        }
      const float mean = count > 1 ? sum / static_cast<float>(count) : 0.0f;
      const bool smooth = max - min <= 0.02f + 4.0f * depth_sigma_m(mean);
      tile_scratch[static_cast<std::size_t>(ty * tiles_x + tx)] = smooth ? mean : 0.0f;
    }
  const auto tiles = tile_scratch.first(tiles_count(width, height));
  // The scratch's tail holds one row of slopes at full resolution.
  auto* slopes = reinterpret_cast<std::uint16_t*>(tile_scratch.data() + tiles.size());
  const auto fx = static_cast<float>(full.fx), fy = static_cast<float>(full.fy);
  const auto cx = static_cast<float>(full.cx), cy = static_cast<float>(full.cy);
  const auto signed_byte = [](float slope) {
    const float units = slope / kSlopeUnitM;
    const float limited = units < -127.0f ? -127.0f : (units > 127.0f ? 127.0f : units);
    return static_cast<std::uint16_t>(
        static_cast<std::uint8_t>(static_cast<std::int8_t>(std::nearbyint(limited))));
  };
  for (int ty = 0; ty < tiles_y; ++ty) {
    for (int tx = 0; tx < tiles_x; ++tx) {
      const auto tile = static_cast<std::size_t>(ty * tiles_x + tx);
      const float z = tiles[tile];
      const int x0 = tx > 0 ? tx - 1 : tx, x1 = tx + 1 < tiles_x ? tx + 1 : tx;
      const int y0 = ty > 0 ? ty - 1 : ty, y1 = ty + 1 < tiles_y ? ty + 1 : ty;
      const float left = tiles[static_cast<std::size_t>(ty * tiles_x + x0)];
      const float right = tiles[static_cast<std::size_t>(ty * tiles_x + x1)];
      const float up = tiles[static_cast<std::size_t>(y0 * tiles_x + tx)];
      const float down = tiles[static_cast<std::size_t>(y1 * tiles_x + tx)];
      // Where a neighbour is missing or beyond an edge the surface is taken to face the camera, with little
      // weight.
      float cosine = 1.0f, trust = 0.25f, z_u = 0.0f, z_v = 0.0f;
      if (z > 0 && left > 0 && right > 0 && up > 0 && down > 0) {
        // For z(u, v) the plane's normal is (-fx z_u, -fy z_v, z + (u - cx) z_u + (v - cy) z_v), and its
        // product with the ray ((u - cx) / fx, (v - cy) / fy, 1) is z.
        z_u = (right - left) / static_cast<float>(4 * (x1 - x0));
        z_v = (down - up) / static_cast<float>(4 * (y1 - y0));
        const float u = static_cast<float>(4 * tx) + 1.5f - cx, v = static_cast<float>(4 * ty) + 1.5f - cy;
        const float nx = fx * z_u, ny = fy * z_v, nz = z + u * z_u + v * z_v;
        cosine = z / std::sqrt(nx * nx + ny * ny + nz * nz);
        trust = cosine;
      }
      // Below 0.2 (78 degrees) sensors return nothing that can be trusted.
      cosine = cosine < 0.2f ? 0.2f : (cosine > 1.27f ? 1.27f : cosine);
      const float relative = z > 0 ? depth_sigma_m(1.0f) / depth_sigma_m(z) : 0.0f;
      float weight = 32.0f * relative * relative * trust;
      weight = weight < 1.0f ? 1.0f : (weight > 32.0f ? 32.0f : weight);
      image.tiles[tile] = static_cast<std::uint16_t>(static_cast<unsigned>(cosine * 200.0f + 0.5f) |
                                                     static_cast<unsigned>(weight + 0.5f) << 8);
      const auto packed = static_cast<std::uint16_t>(signed_byte(z_u) | signed_byte(z_v) << 8);
      for (int i = 0; i < 4; ++i) slopes[4 * tx + i] = packed;
    }
    for (int y = 4 * ty; y < 4 * ty + 4; ++y) {
      const std::size_t row = static_cast<std::size_t>(y) * static_cast<std::size_t>(width);
      HWY_DYNAMIC_DISPATCH(PackRow)(&depth[row], slopes, static_cast<std::size_t>(width), &image.pixels[row]);
    }
  }
}

}  // namespace tactus
#endif
