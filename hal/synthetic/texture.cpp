#include "hal/synthetic/texture.hpp"

#include <algorithm>
#include <cmath>

#include "hal/synthetic/deterministic_math.hpp"

namespace tactus::hal::synthetic {
namespace {

/// Uniform number of a lattice point; x and y in [0, 2 * period).
float lattice(int x, int y, int period, std::uint32_t seed) {
  const auto wrapped = [&](int i) { return static_cast<std::uint64_t>(i < period ? i : i - period); };
  return uniform01(hash64(wrapped(x) | wrapped(y) << 16 | static_cast<std::uint64_t>(seed) << 32));
}

/// Value noise in [0, 1) with `period` lattice cells in the unit square.
float value_noise(float u, float v, int period, std::uint32_t seed) {
  const float x = u * static_cast<float>(period), y = v * static_cast<float>(period);
  const float fx = std::floor(x), fy = std::floor(y);
  const int ix = static_cast<int>(fx), iy = static_cast<int>(fy);
  float a = x - fx, b = y - fy;
  a = a * a * (3 - 2 * a);
  b = b * b * (3 - 2 * b);
  const float top = lattice(ix, iy, period, seed) * (1 - a) + lattice(ix + 1, iy, period, seed) * a;
  const float bottom =
      lattice(ix, iy + 1, period, seed) * (1 - a) + lattice(ix + 1, iy + 1, period, seed) * a;
  return top * (1 - b) + bottom * b;
}

/// Three octaves, mean about 0.5.
float mottling(float u, float v, int period, std::uint32_t seed) {
  return 0.55F * value_noise(u, v, period, seed) + 0.3F * value_noise(u, v, period * 2, seed + 1) +
         0.15F * value_noise(u, v, period * 4, seed + 2);
}

float fraction(float x) { return x - std::floor(x); }
float wave(float turns) { return static_cast<float>(sin_cos_turns(static_cast<double>(turns)).sin); }
/// 0 below `edge - width`, 1 above `edge + width`.
float ramp(float x, float edge, float width) {
  return std::min(std::max((x - edge + width) / (2 * width), 0.0F), 1.0F);
}

struct Color {
  float r = 0, g = 0, b = 0;
};
Color from(Rgb8 c) { return {static_cast<float>(c.r), static_cast<float>(c.g), static_cast<float>(c.b)}; }
Color mix(const Color& a, const Color& b, float t) {
  return {a.r + (b.r - a.r) * t, a.g + (b.g - a.g) * t, a.b + (b.b - a.b) * t};
}
Color scaled(const Color& c, float s) { return {c.r * s, c.g * s, c.b * s}; }

Color pattern_at(const TextureSpec& spec, float u, float v) {
  const Color base = from(spec.base), second = from(spec.second);
  const auto n = static_cast<float>(spec.repeats);
  const auto seed = spec.seed * 64 + 1;
  const auto contrast = static_cast<float>(spec.contrast);
  // Cells of the motif get a tone of their own, as real boards, bricks and tiles have.
  const auto tone_of = [&](int column, int row, std::uint32_t salt) {
    return 1 + contrast * (lattice(column, row, spec.repeats * 2, seed + salt) - 0.5F);
  };
  const float soft = 1 + contrast * (mottling(u, v, 5, seed + 7) - 0.5F);
  switch (spec.pattern) {
    case Pattern::plain:
      return scaled(mix(base, second, mottling(u, v, 4, seed) * contrast * 2), soft);
    case Pattern::noise:
      return mix(base, second, ramp(mottling(u, v, spec.repeats, seed), 0.5F, 0.22F));
    case Pattern::checks: {
      const float a = ramp(std::fabs(fraction(u * n / 2) - 0.5F), 0.25F, 0.02F);
      const float b = ramp(std::fabs(fraction(v * n / 2) - 0.5F), 0.25F, 0.02F);
      return scaled(mix(base, second, a + b - 2 * a * b), soft);
    }
    case Pattern::stripes: {
      const float s = ramp(std::fabs(fraction(u * n) - 0.5F), 0.25F, 0.05F);
      return scaled(mix(base, second, s), soft);
    }
    case Pattern::planks: {
      const int row = static_cast<int>(v * n);
      const float shift = lattice(row, 3, 64, seed);
      const float along = fraction(u + shift);
      const float seam =
          std::min(std::min(fraction(v * n), 1 - fraction(v * n)) / n, std::min(along, 1 - along)) *
          128;  // texels to the nearest joint
      const float warp = 0.35F * value_noise(u, v, 6, seed + 3);
      const float grain = 0.5F + 0.5F * wave(v * n * 5 + warp * 6 + shift * 7);
      const float fine = value_noise(u, v, 64, seed + 5);
      const Color wood = mix(base, second, contrast * (0.6F * grain + 0.7F * fine));
      return scaled(wood, (0.8F + 0.4F * lattice(row, static_cast<int>(u + shift), 64, seed + 9)) *
                              (0.55F + 0.45F * ramp(seam, 1.2F, 1.0F)));
    }
    case Pattern::grain: {
      const float warp = value_noise(u, v, 3, seed) + 0.4F * value_noise(u, v, 9, seed + 1);
      const float rings = 0.5F + 0.5F * wave(u * n + warp * 1.7F);
      const float fine = value_noise(u, fraction(v * 0.25F), 48, seed + 2);
      return mix(base, second, contrast * (0.9F * rings + 0.8F * fine));
    }
    case Pattern::bricks: {
      const int row = static_cast<int>(v * n);
      const float along = fraction(u * n / 2 + (row % 2 == 0 ? 0.0F : 0.5F));
      const int column = static_cast<int>(u * n / 2 + (row % 2 == 0 ? 0.0F : 0.5F));
      const float up = fraction(v * n);
      const float joint = std::min(std::min(along, 1 - along) * 2, std::min(up, 1 - up));
      const Color stone = scaled(base, tone_of(column % (spec.repeats / 2), row, 0) * soft *
                                           (0.85F + 0.3F * mottling(u, v, 24, seed + 4)));
      return mix(second, stone, ramp(joint, 0.09F, 0.04F));
    }
    case Pattern::tiles: {
      const int column = static_cast<int>(u * n), row = static_cast<int>(v * n);
      const float x = fraction(u * n), y = fraction(v * n);
      const float joint = std::min(std::min(x, 1 - x), std::min(y, 1 - y));
      const Color face = scaled(base, tone_of(column, row, 2) * soft);
      return mix(second, face, ramp(joint, 0.05F, 0.025F));
    }
    case Pattern::weave: {
      const float threads = 0.5F + 0.25F * wave(u * n * 4) + 0.25F * wave(v * n * 4);
      return scaled(mix(base, second, contrast * threads), 0.8F + 0.4F * mottling(u, v, 8, seed));
    }
    case Pattern::speckle: {
      const float coarse = value_noise(u, v, 20, seed), fine = value_noise(u, v, 43, seed + 1);
      const float spots = ramp(coarse * 0.5F + fine * 0.5F, 0.56F, 0.08F);
      return scaled(mix(base, second, spots), soft);
    }
    case Pattern::damask: {
      const float x = fraction(u * n) - 0.5F, y = fraction(v * n) - 0.5F;
      const float diamond = std::fabs(x) + std::fabs(y) + 0.06F * wave(5 * (x + y)) * wave(5 * (x - y));
      const float ring = ramp(0.06F - std::fabs(diamond - 0.33F), 0.0F, 0.03F);
      const float heart = ramp(0.13F - diamond, 0.0F, 0.03F);
      const float stripe = 0.25F * ramp(0.04F - std::fabs(fraction(u * n) - 0.02F), 0.0F, 0.02F);
      return scaled(mix(base, second, std::min(1.0F, ring + heart + stripe)), soft);
    }
    case Pattern::print: {
      const int row = static_cast<int>(v * n);
      const float up = fraction(v * n);
      const bool is_margin = u < 0.1F || u > 0.9F - 0.25F * lattice(row, 1, 64, seed) || row % 9 == 8;
      const float word = value_noise(u, static_cast<float>(row) / n, 40, seed + 3);
      const float ink =
          is_margin ? 0.0F : ramp(0.3F - std::fabs(up - 0.5F), 0.0F, 0.1F) * ramp(word, 0.35F, 0.1F);
      return scaled(mix(base, second, ink * 0.8F), 1 + 0.1F * (mottling(u, v, 4, seed) - 0.5F));
    }
    case Pattern::picture: {
      const float warp = 0.25F * value_noise(u, v, 3, seed);
      const float x = fraction(u + warp), y = fraction(v + warp * 0.7F);
      const int column = static_cast<int>(x * n), row = static_cast<int>(y * n);
      const Color patch{60 + 180 * lattice(column, row, 64, seed + 1),
                        50 + 170 * lattice(column, row, 64, seed + 2),
                        60 + 170 * lattice(column, row, 64, seed + 3)};
      return mix(mix(base, second, v), patch, 0.35F + 0.5F * value_noise(u, v, 7, seed + 4));
    }
    case Pattern::leaves: {
      const float rib =
          ramp(0.08F - std::fabs(fraction(u * n + 0.8F * std::fabs(v - 0.5F)) - 0.5F), 0.0F, 0.06F);
      return scaled(mix(base, second, 0.6F * rib + 0.5F * mottling(u, v, 10, seed)), soft);
    }
    case Pattern::clouds:
      return mix(base, second, ramp(mottling(u, v, 3, seed), 0.55F, 0.2F));
  }
  return base;
}

std::uint32_t pack(const Color& c) {
  const auto channel = [](float v) {
    return static_cast<std::uint32_t>(std::min(std::max(v, 0.0F), 255.0F) + 0.5F);
  };
  return channel(c.r) | channel(c.g) << 8 | channel(c.b) << 16;
}

}  // namespace

Texture::Texture(const TextureSpec& spec) {
  constexpr int kSize = 1 << kLog2Size;
  texel_m_ = static_cast<float>(spec.period_m / kSize);
  texels_per_m_ = static_cast<float>(kSize / spec.period_m);
  texels_.reserve(kSize * kSize * 4 / 3 + 1);
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x)
      texels_.push_back(pack(
          pattern_at(spec, (static_cast<float>(x) + 0.5F) / kSize, (static_cast<float>(y) + 0.5F) / kSize)));
  std::size_t above = 0;
  for (int size = kSize / 2; size >= 1; size /= 2) {
    const auto wide = static_cast<std::size_t>(size) * 2;
    for (std::size_t y = 0; y < wide; y += 2)
      for (std::size_t x = 0; x < wide; x += 2) {
        std::uint32_t mean = 0;
        for (int shift = 0; shift < 24; shift += 8) {
          std::uint32_t sum = 2;
          for (std::size_t corner = 0; corner < 4; ++corner)
            sum += texels_[above + (y + corner / 2) * wide + x + corner % 2] >> shift & 255U;
          mean |= sum / 4 << shift;
        }
        texels_.push_back(mean);
      }
    above += wide * wide;
  }
}

Rgb8 Texture::sample(float u_m, float v_m, float footprint_m) const {
  int level = 0;
  std::size_t first = 0;
  float scale = texels_per_m_;
  for (float texel_m = texel_m_ * 1.5F; footprint_m > texel_m && level < kLog2Size - 2; texel_m *= 2) {
    first += std::size_t{1} << (2 * (kLog2Size - level));
    ++level;
    scale *= 0.5F;
  }
  // Fixed point with 8 fractional bits; the offset, a multiple of every period, keeps the truncation a floor.
  constexpr float kOffset = 8192;
  const auto u = static_cast<std::uint32_t>((u_m * scale - 0.5F + kOffset) * 256);
  const auto v = static_cast<std::uint32_t>((v_m * scale - 0.5F + kOffset) * 256);
  const int log2_size = kLog2Size - level;
  const std::uint32_t mask = (1U << log2_size) - 1;
  const std::uint32_t x0 = u >> 8 & mask, x1 = (x0 + 1) & mask;
  const std::uint32_t y0 = v >> 8 & mask, y1 = (y0 + 1) & mask;
  const std::uint32_t* texels = texels_.data() + first;
  const std::uint32_t a = u & 255U, b = v & 255U;
  // Red and blue travel together in one word, green in another.
  const auto blend = [](std::uint32_t p, std::uint32_t q, std::uint32_t t) {
    const std::uint32_t red_blue = ((p & 0xff00ffU) * (256 - t) + (q & 0xff00ffU) * t) >> 8 & 0xff00ffU;
    const std::uint32_t green = ((p & 0xff00U) * (256 - t) + (q & 0xff00U) * t) >> 8 & 0xff00U;
    return red_blue | green;
  };
  const std::uint32_t c = blend(blend(texels[(y0 << log2_size) + x0], texels[(y0 << log2_size) + x1], a),
                                blend(texels[(y1 << log2_size) + x0], texels[(y1 << log2_size) + x1], a), b);
  return {static_cast<std::uint8_t>(c & 255U), static_cast<std::uint8_t>(c >> 8 & 255U),
          static_cast<std::uint8_t>(c >> 16 & 255U)};
}

}  // namespace tactus::hal::synthetic
