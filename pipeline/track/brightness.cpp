#include "pipeline/track/brightness.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/track/brightness.cpp"
#include "hwy/foreach_target.h"
// clang-format off
#include "hwy/highway.h"
// clang-format on
#include "pipeline/register/depth_images.hpp"
#include "rt/assert.hpp"
#include "rt/worker_pool.hpp"

#ifndef TACTUS_TRACK_RENDER_CONSTANTS
#define TACTUS_TRACK_RENDER_CONSTANTS  // this file is compiled once per instruction set
namespace tactus::track {

constexpr float kRenderNearM = 0.2f;
constexpr float kOcclusionBaseM = 0.03f, kOcclusionSigmas = 6.0f;

struct RenderConstants {
  RenderConstants(const KeyframeImage& keyframe, const Transform<Depth, Depth>& T_key_view)
      : fx(static_cast<float>(keyframe.camera.fx)),
        fy(static_cast<float>(keyframe.camera.fy)),
        cx(static_cast<float>(keyframe.camera.cx)),
        cy(static_cast<float>(keyframe.camera.cy)),
        inverse_fx(1.0f / fx),
        inverse_fy(1.0f / fy),
        width(keyframe.camera.width),
        height(keyframe.camera.height) {
    for (std::size_t i = 0; i < 9; ++i) r[i] = static_cast<float>(T_key_view.rotation.m[i]);
    t[0] = static_cast<float>(T_key_view.translation.x);
    t[1] = static_cast<float>(T_key_view.translation.y);
    t[2] = static_cast<float>(T_key_view.translation.z);
  }
  float r[9], t[3];
  float fx, fy, cx, cy, inverse_fx, inverse_fy;
  int width, height;
};

}  // namespace tactus::track
#endif

HWY_BEFORE_NAMESPACE();
namespace tactus::track::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

RenderedCounts RenderRow(const RenderConstants& c, const Luma* HWY_RESTRICT luma,
                         const std::uint16_t* HWY_RESTRICT depth, const float* HWY_RESTRICT view_z_m, int row,
                         std::uint16_t* HWY_RESTRICT quarters) {
  const hn::CappedTag<float, 16> df;
  const hn::RebindToSigned<decltype(df)> di;
  const hn::RebindToUnsigned<decltype(df)> du;
  const hn::Rebind<std::uint16_t, decltype(df)> d16;
  const std::size_t lanes = hn::Lanes(df);
  const auto width = static_cast<std::size_t>(c.width);
  const auto set = [&](float v) { return hn::Set(df, v); };
  const auto zero = hn::Zero(df), one = set(1.0f);
  const float ray_b = (static_cast<float>(row) - c.cy) * c.inverse_fy;
  RenderedCounts counts;
  for (std::size_t column = 0; column < width; column += lanes) {
    // The last group of a row whose width is no multiple of the lanes overlaps the one before; counted once.
    const std::size_t first = column + lanes <= width ? column : width - lanes;
    const auto z = hn::LoadU(df, view_z_m + first);
    const auto index = hn::Add(hn::Iota(di, static_cast<std::int32_t>(first)), hn::Zero(di));
    const auto fresh = hn::RebindMask(df, hn::Gt(index, hn::Set(di, static_cast<std::int32_t>(column) - 1)));
    const auto surface = hn::Gt(z, zero);
    const auto x = hn::Mul(hn::Mul(hn::Sub(hn::ConvertTo(df, index), set(c.cx)), set(c.inverse_fx)), z);
    const auto y = hn::Mul(set(ray_b), z);
    const auto moved = [&](std::size_t i) {
      return hn::Add(hn::Add(hn::Mul(set(c.r[i * 3]), x), hn::Mul(set(c.r[i * 3 + 1]), y)),
                     hn::Add(hn::Mul(set(c.r[i * 3 + 2]), z), set(c.t[i])));
    };
    const auto kz = moved(2);
    auto known = hn::And(surface, hn::Gt(kz, set(kRenderNearM)));
    const auto inverse = hn::Div(one, hn::IfThenElse(known, kz, one));
    const auto ku = hn::Add(hn::Mul(hn::Mul(moved(0), inverse), set(c.fx)), set(c.cx));
    const auto kv = hn::Add(hn::Mul(hn::Mul(moved(1), inverse), set(c.fy)), set(c.cy));
    const auto within = [&](auto v, int count) {
      return hn::And(hn::Gt(v, zero), hn::Lt(v, set(static_cast<float>(count - 1))));
    };
    known = hn::And(known, hn::And(within(ku, c.width), within(kv, c.height)));
    const auto u = hn::IfThenElseZero(known, ku), v = hn::IfThenElseZero(known, kv);
    const auto u0 = hn::Floor(u), v0 = hn::Floor(v);
    const auto pitch = hn::Set(di, c.width);
    const auto nearest = hn::Add(hn::Mul(hn::NearestInt(v), pitch), hn::NearestInt(u));
    const auto corner = hn::Add(hn::Mul(hn::ConvertTo(di, v0), pitch), hn::ConvertTo(di, u0));
    // 16-bit and 8-bit pixels through 32-bit gathers; the images are padded.
    const auto seen_word =
        hn::GatherOffset(du, reinterpret_cast<const std::uint32_t*>(depth), hn::ShiftLeft<1>(nearest));
    const auto seen = hn::ConvertTo(df, hn::BitCast(di, hn::And(seen_word, hn::Set(du, 0xFFFFu))));
    const auto off = hn::Sub(kz, set(0.4f));
    const auto sigma = hn::Add(set(0.0012f), hn::Mul(set(0.0019f), hn::Mul(off, off)));
    const auto gate = hn::Add(set(kOcclusionBaseM), hn::Mul(set(kOcclusionSigmas), sigma));
    known = hn::And(known, hn::And(hn::Gt(seen, zero),
                                   hn::Lt(hn::Abs(hn::Sub(hn::Mul(seen, set(kDepthUnitM)), kz)), gate)));
    const auto upper = hn::GatherOffset(du, reinterpret_cast<const std::uint32_t*>(luma), corner);
    const auto lower = hn::GatherOffset(du, reinterpret_cast<const std::uint32_t*>(luma + width), corner);
    const auto byte = hn::Set(du, 0xFFu);
    const auto as_float = [&](auto word) { return hn::ConvertTo(df, hn::BitCast(di, hn::And(word, byte))); };
    const auto l00 = as_float(upper), l10 = as_float(hn::ShiftRight<8>(upper));
    const auto l01 = as_float(lower), l11 = as_float(hn::ShiftRight<8>(lower));
    known = hn::And(known, hn::Gt(hn::Min(hn::Min(l00, l10), hn::Min(l01, l11)), zero));
    const auto tu = hn::Sub(u, u0), tv = hn::Sub(v, v0);
    const auto top = hn::Add(l00, hn::Mul(hn::Sub(l10, l00), tu));
    const auto bottom = hn::Add(l01, hn::Mul(hn::Sub(l11, l01), tu));
    const auto value = hn::Mul(hn::Add(top, hn::Mul(hn::Sub(bottom, top), tv)), set(4.0f));
    const auto word = hn::IfThenElseZero(hn::RebindMask(di, known), hn::NearestInt(value));
    hn::StoreU(hn::DemoteTo(d16, word), d16, quarters + first);
    counts.surface += static_cast<std::uint32_t>(hn::CountTrue(df, hn::And(surface, fresh)));
    counts.known += static_cast<std::uint32_t>(hn::CountTrue(df, hn::And(known, fresh)));
  }
  return counts;
}

void DifferencesRow(const std::uint16_t* HWY_RESTRICT row, std::size_t width, BrightnessWord* HWY_RESTRICT words) {
  const hn::CappedTag<std::int32_t, 16> di;
  const hn::RebindToUnsigned<decltype(di)> du;
  const hn::Rebind<std::uint16_t, decltype(di)> d16;
  const std::size_t lanes = hn::Lanes(di);
  const std::size_t end = width - 1;
  for (std::size_t column = 1; column < end; column += lanes) {
    const std::size_t u = column + lanes <= end ? column : end - lanes;
    const auto at = [&](const std::uint16_t* p) { return hn::PromoteTo(di, hn::LoadU(d16, p + u)); };
    const auto middle = at(row), left = at(row - 1), right = at(row + 1), up = at(row - width), down = at(row + width);
    const auto least = hn::Min(hn::Min(middle, hn::Min(left, right)), hn::Min(up, down));
    const auto along_u = hn::And(hn::Sub(right, left), hn::Set(di, 0x7FF));
    const auto along_v = hn::Sub(down, up);
    const auto word = hn::Or(middle, hn::Or(hn::ShiftLeft<10>(along_u), hn::ShiftLeft<21>(along_v)));
    hn::StoreU(hn::BitCast(du, hn::IfThenElseZero(hn::Gt(least, hn::Zero(di)), word)), du, words + u);
  }
}

void LumaOf(const std::uint32_t* HWY_RESTRICT color, std::size_t count, Luma* HWY_RESTRICT luma) {
  const hn::CappedTag<std::int32_t, 16> di;
  const hn::RebindToUnsigned<decltype(di)> du;
  const hn::Rebind<std::uint8_t, decltype(di)> d8;
  const std::size_t lanes = hn::Lanes(di);
  const auto byte = hn::Set(du, 0xFFu);
  for (std::size_t at = 0; at < count; at += lanes) {
    const std::size_t i = at + lanes <= count ? at : count - lanes;
    const auto word = hn::LoadU(du, color + i);
    const auto r = hn::And(word, byte), g = hn::And(hn::ShiftRight<8>(word), byte),
               b = hn::And(hn::ShiftRight<16>(word), byte);
    const auto sum = hn::Add(hn::Add(r, hn::Add(g, g)), hn::Add(b, hn::Set(du, 2u)));
    const auto grey = hn::Max(hn::BitCast(di, hn::ShiftRight<2>(sum)), hn::Set(di, 1));
    const auto known = hn::Ne(hn::BitCast(di, hn::ShiftRight<24>(word)), hn::Zero(di));
    hn::StoreU(hn::DemoteTo(d8, hn::IfThenElseZero(known, grey)), d8, luma + i);
  }
}

}  // namespace tactus::track::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tactus::track {
HWY_EXPORT(RenderRow);
HWY_EXPORT(DifferencesRow);
HWY_EXPORT(LumaOf);

namespace {
constexpr int kRowsPerChunk = 16;
constexpr int kShareRowStride = 8;
}  // namespace

void luma_of(std::span<const std::uint32_t> half_color, std::span<Luma> luma) noexcept {
  TACTUS_ASSERT(luma.size() >= half_color.size() && half_color.size() >= 16);
  HWY_DYNAMIC_DISPATCH(LumaOf)(half_color.data(), half_color.size(), luma.data());
}

RenderedCounts render_quarters(const KeyframeImage& keyframe, const Transform<Depth, Depth>& T_key_view,
                               std::span<const float> view_z_m, int row_begin, int row_end,
                               std::span<std::uint16_t> quarters) noexcept {
  const RenderConstants constants(keyframe, T_key_view);
  RenderedCounts counts;
  for (int row = row_begin; row < row_end; ++row) {
    const auto first = static_cast<std::size_t>(row) * static_cast<std::size_t>(keyframe.camera.width);
    const RenderedCounts in_row = HWY_DYNAMIC_DISPATCH(RenderRow)(
        constants, keyframe.luma.data(), keyframe.depth.data(), &view_z_m[first], row, &quarters[first]);
    counts.surface += in_row.surface;
    counts.known += in_row.known;
  }
  return counts;
}

RenderedCounts render_quarters_reference(const KeyframeImage& keyframe, const Transform<Depth, Depth>& T_key_view,
                                         std::span<const float> view_z_m, int row_begin, int row_end,
                                         std::span<std::uint16_t> quarters) noexcept {
  const RenderConstants c(keyframe, T_key_view);
  const auto width = static_cast<std::size_t>(c.width);
  RenderedCounts counts;
  for (int row = row_begin; row < row_end; ++row)
    for (int column = 0; column < c.width; ++column) {
      const std::size_t pixel = static_cast<std::size_t>(row) * width + static_cast<std::size_t>(column);
      quarters[pixel] = 0;
      const float z = view_z_m[pixel];
      if (!(z > 0)) continue;
      ++counts.surface;
      const float x = (static_cast<float>(column) - c.cx) * c.inverse_fx * z;
      const float y = (static_cast<float>(row) - c.cy) * c.inverse_fy * z;
      const auto moved = [&](std::size_t i) {
        return (c.r[i * 3] * x + c.r[i * 3 + 1] * y) + (c.r[i * 3 + 2] * z + c.t[i]);
      };
      const float kz = moved(2);
      if (!(kz > kRenderNearM)) continue;
      const float inverse = 1.0f / kz;
      const float u = moved(0) * inverse * c.fx + c.cx, v = moved(1) * inverse * c.fy + c.cy;
      if (!(u > 0 && v > 0 && u < static_cast<float>(c.width - 1) && v < static_cast<float>(c.height - 1))) continue;
      const float u0 = std::floor(u), v0 = std::floor(v), tu = u - u0, tv = v - v0;
      const std::size_t nearest = static_cast<std::size_t>(std::nearbyint(v)) * width +
                                  static_cast<std::size_t>(std::nearbyint(u));
      const std::size_t corner = static_cast<std::size_t>(v0) * width + static_cast<std::size_t>(u0);
      const auto seen = static_cast<float>(keyframe.depth[nearest]);
      const float off = kz - 0.4f;
      const float sigma = 0.0012f + 0.0019f * (off * off);
      if (!(seen > 0 && std::fabs(seen * kDepthUnitM - kz) < kOcclusionBaseM + kOcclusionSigmas * sigma)) continue;
      const auto luma = [&](std::size_t i) { return static_cast<float>(keyframe.luma[i]); };
      const float l00 = luma(corner), l10 = luma(corner + 1), l01 = luma(corner + width), l11 = luma(corner + width + 1);
      if (!(std::min(std::min(l00, l10), std::min(l01, l11)) > 0)) continue;
      ++counts.known;
      const float top = l00 + (l10 - l00) * tu, bottom = l01 + (l11 - l01) * tu;
      quarters[pixel] = static_cast<std::uint16_t>(std::nearbyint((top + (bottom - top) * tv) * 4.0f));
    }
  return counts;
}

void take_differences(std::span<const std::uint16_t> quarters, int width, int height, int row_begin, int row_end,
                      std::span<BrightnessWord> words) noexcept {
  const auto w = static_cast<std::size_t>(width);
  for (int row = row_begin; row < row_end; ++row) {
    BrightnessWord* out = &words[static_cast<std::size_t>(row) * w];
    out[0] = out[w - 1] = 0;
    if (row == 0 || row == height - 1) {
      std::fill_n(out, w, BrightnessWord{0});
    } else {
      HWY_DYNAMIC_DISPATCH(DifferencesRow)(&quarters[static_cast<std::size_t>(row) * w], w, out);
    }
  }
}

std::size_t BrightnessKeyframes::bytes_needed(const hal::Intrinsics& half_camera, const BrightnessConfig& config) {
  const auto count = static_cast<std::size_t>(half_camera.width) * static_cast<std::size_t>(half_camera.height);
  return config.keyframes_capacity *
             (rt::bytes_of<Luma>(count + kLumaPadding) + rt::bytes_of<std::uint16_t>(count + 1)) +
         rt::bytes_of<std::uint16_t>(count) + rt::bytes_of<BrightnessWord>(count);
}

void BrightnessKeyframes::bind(rt::Slice& memory, const hal::Intrinsics& half_camera, const BrightnessConfig& config) {
  TACTUS_ASSERT(config.keyframes_capacity >= 2 && config.keyframes_capacity <= kKeyframesMax);
  TACTUS_ASSERT(half_camera.width >= 32);
  config_ = config;
  const auto count = static_cast<std::size_t>(half_camera.width) * static_cast<std::size_t>(half_camera.height);
  for (std::uint32_t k = 0; k < config.keyframes_capacity; ++k) {
    keyframes_[k].luma = memory.take<Luma>(count + kLumaPadding);
    keyframes_[k].depth = memory.take<std::uint16_t>(count + 1);
  }
  quarters_ = memory.take<std::uint16_t>(count);
  rendered_ = memory.take<BrightnessWord>(count);
}

float BrightnessKeyframes::share_seen(std::uint32_t keyframe, const map::ModelView& view) noexcept {
  const Keyframe& k = keyframes_[keyframe];
  const auto T_key_world = k.T_world_key.inverse();
  RenderedCounts counts;
  for (int row = kShareRowStride / 2; row < view.camera.height; row += kShareRowStride) {
    const auto in_row = render_quarters({view.camera, k.luma, k.depth}, T_key_world * view.T_world_view, view.z_m,
                                        row, row + 1, quarters_);
    counts.surface += in_row.surface;
    counts.known += in_row.known;
  }
  return counts.surface > 0 ? static_cast<float>(counts.known) / static_cast<float>(counts.surface) : 0.0f;
}

std::uint32_t BrightnessKeyframes::choose(const map::ModelView& view) noexcept {
  std::array<float, kKeyframesMax> shares{};
  for (std::uint32_t k = 0; k < count_; ++k) shares[k] = share_seen(k, view);
  // The oldest among those that see more than `share` and were born before `before`.
  const auto oldest = [&](float share, std::uint32_t before) {
    std::uint32_t best = kKeyframesMax;
    for (std::uint32_t k = 0; k < count_; ++k)
      if (shares[k] > share && born_[k] < before && (best == kKeyframesMax || born_[k] < born_[best])) best = k;
    return best;
  };
  if (current_ < count_) {
    if (const std::uint32_t older = oldest(config_.return_share, born_[current_]); older < count_) return older;
    if (shares[current_] > config_.stay_share) return current_;
  }
  return oldest(config_.stay_share, now_);
}

void BrightnessKeyframes::make(const map::ModelView& view, std::span<const Luma> live,
                               std::span<const float> live_m) noexcept {
  if (count_ < config_.keyframes_capacity) {
    current_ = count_++;
  } else {
    // The oldest gives way, but never the very first, which holds the world's origin.
    current_ = 1;
    for (std::uint32_t k = 2; k < count_; ++k)
      if (born_[k] < born_[current_]) current_ = k;
  }
  Keyframe& k = keyframes_[current_];
  std::copy_n(live.begin(), live_m.size(), k.luma.begin());
  for (std::size_t i = 0; i < live_m.size(); ++i)
    k.depth[i] = static_cast<std::uint16_t>(std::nearbyint(std::min(live_m[i] / kDepthUnitM, 65535.0f)));
  k.T_world_key = view.T_world_view;
  born_[current_] = now_;
}

void BrightnessKeyframes::render(const map::ModelView& view, rt::WorkerPool& pool) noexcept {
  const Keyframe& k = keyframes_[current_];
  const auto T_key_view = k.T_world_key.inverse() * view.T_world_view;
  const int height = view.camera.height;
  const auto chunks = static_cast<std::uint32_t>((height + kRowsPerChunk - 1) / kRowsPerChunk);
  const auto rows_of = [&](std::uint32_t chunk) {
    const int begin = static_cast<int>(chunk) * kRowsPerChunk;
    return std::pair{begin, std::min(height, begin + kRowsPerChunk)};
  };
  pool.run(chunks, [&](std::uint32_t chunk) {
    const auto [begin, end] = rows_of(chunk);
    render_quarters({view.camera, k.luma, k.depth}, T_key_view, view.z_m, begin, end, quarters_);
  });
  pool.run(chunks, [&](std::uint32_t chunk) {
    const auto [begin, end] = rows_of(chunk);
    take_differences(quarters_, view.camera.width, height, begin, end, rendered_);
  });
  has_rendering_ = true;
}

void BrightnessKeyframes::follow(const map::ModelView& view, std::span<const Luma> live,
                                 std::span<const float> live_m, rt::WorkerPool& pool) noexcept {
  ++now_;
  has_rendering_ = false;
  current_ = choose(view);
  if (current_ == kKeyframesMax && !live.empty()) make(view, live, live_m);
  if (current_ != kKeyframesMax) render(view, pool);
}

bool BrightnessKeyframes::agrees_with(std::span<const Luma> live) noexcept {
  if (!has_rendering_) return false;
  std::int64_t sum = 0, count = 0;
  for (std::size_t i = 0; i < rendered_.size(); i += 13) {  // a prime stride: no column is preferred
    if (rendered_[i] == 0 || live[i] == 0) continue;
    sum += std::int64_t{live[i]} * 4 - static_cast<std::int64_t>(rendered_[i] & 0x3FFu);
    ++count;
  }
  const auto limit = static_cast<std::int64_t>(config_.exposure_grey_max * 4);
  if (std::abs(sum) <= limit * count) return true;
  --count_;
  std::swap(keyframes_[current_], keyframes_[count_]);
  std::swap(born_[current_], born_[count_]);
  current_ = kKeyframesMax;
  has_rendering_ = false;
  return false;
}

}  // namespace tactus::track
#endif
