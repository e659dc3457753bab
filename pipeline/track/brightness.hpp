// Brightness that does not drift. Texture is finer than the map's cells, so that the map cannot say what a surface looks
// like; a few past frames can. One of them, the keyframe, is rendered from the predicted view through the model's depth,
// and tracking compares the live image with that (Kerl et al. 2013 track against keyframes for the same reason): its
// error stays that of the keyframe's pose instead of growing with every frame. Back where an older keyframe sees most of
// the view, the older one serves again and takes the drift away that has come in meanwhile.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "hal/calibration.hpp"
#include "hal/transform.hpp"
#include "pipeline/map/predict.hpp"
#include "rt/slice.hpp"

namespace tactus::rt {
class WorkerPool;
}

namespace tactus::track {

/// Brightness of a half-resolution pixel, (R + 2 G + B) / 4, at least 1; 0 where unknown.
using Luma = std::uint8_t;
/// Luma images are this much longer than their pixels: kernels read them in 32-bit words.
inline constexpr std::size_t kLumaPadding = 4;

/// From packed colours (pipeline/register/half_color.hpp). Step.
void luma_of(std::span<const std::uint32_t> half_color, std::span<Luma> luma) noexcept;

/// A pixel of the rendered view: brightness in quarters of a grey level (bits 0-9), and the difference of its neighbours'
/// along u (10-20) and v (21-31), signed, in the same unit. 0 where the pixel or one of its four neighbours is unknown.
using BrightnessWord = std::uint32_t;

struct BrightnessConfig {
  std::uint32_t keyframes_capacity = 4;  // at least 2. 8 do no better on four recordings
  // Share of the view's surface a keyframe must see to go on serving: half lets a doubtful depth at one moment rule for
  // too long (7-Scenes kitchen 14 mm at 0.7, 77 mm at 0.5).
  float stay_share = 0.65f;
  float return_share = 0.75f;  // more for an older one to serve again, so that two do not alternate
  // Mean difference in grey levels at which light or exposure have changed: the keyframe is dropped.
  float exposure_grey_max = 16.0f;
};

/// Past frames' brightness and depth, in fixed memory. Step: one thread, and helpers of its pool inside a call.
class BrightnessKeyframes {
 public:
  static std::size_t bytes_needed(const hal::Intrinsics& half_camera, const BrightnessConfig& config);
  void bind(rt::Slice& memory, const hal::Intrinsics& half_camera, const BrightnessConfig& config);

  /// Chooses the keyframe that serves `view` (or makes one of the live frame, which was taken where the view is; an empty
  /// `live` makes none) and renders it. Costs one rendering and at most an eighth of one per stored keyframe.
  void follow(const map::ModelView& view, std::span<const Luma> live, std::span<const float> live_m,
              rt::WorkerPool& pool) noexcept;
  /// The last rendering; empty when there is none.
  [[nodiscard]] std::span<const BrightnessWord> rendered() const noexcept {
    return has_rendering_ ? rendered_ : std::span<BrightnessWord>{};
  }
  /// False when the light has changed since the serving keyframe was taken: it is forgotten, and so is the rendering.
  bool agrees_with(std::span<const Luma> live) noexcept;

  [[nodiscard]] std::uint32_t keyframes_count() const noexcept { return count_; }
  /// Frame in which the serving keyframe was made, counted by calls of follow() from 1; 0: none.
  [[nodiscard]] std::uint32_t serving() const noexcept { return current_ < count_ ? born_[current_] : 0; }

 private:
  struct Keyframe {
    std::span<Luma> luma;
    std::span<std::uint16_t> depth;  // kDepthUnitM
    T_WorldDepth T_world_key;
  };
  static constexpr std::uint32_t kKeyframesMax = 16;

  [[nodiscard]] float share_seen(std::uint32_t keyframe, const map::ModelView& view) noexcept;
  [[nodiscard]] std::uint32_t choose(const map::ModelView& view) noexcept;
  void make(const map::ModelView& view, std::span<const Luma> live, std::span<const float> live_m) noexcept;
  void render(const map::ModelView& view, rt::WorkerPool& pool) noexcept;

  BrightnessConfig config_;
  std::array<Keyframe, kKeyframesMax> keyframes_{};
  std::array<std::uint32_t, kKeyframesMax> born_{};
  std::uint32_t count_ = 0, current_ = kKeyframesMax, now_ = 0;
  std::span<std::uint16_t> quarters_;  // the rendering before its differences are taken; 0 unknown
  std::span<BrightnessWord> rendered_;
  bool has_rendering_ = false;
};

/// Kernels of a rendering, for the class and its tests; rows [row_begin, row_end) of the view.
struct KeyframeImage {
  hal::Intrinsics camera;  // of keyframe and view
  std::span<const Luma> luma;
  std::span<const std::uint16_t> depth;  // one longer than the pixels: read in 32-bit words
};
struct RenderedCounts {
  std::uint32_t surface = 0, known = 0;  // pixels of the view with a surface; those the keyframe sees
};
/// Brightness in quarters of a grey level, 0 where the view has no surface or the keyframe does not see it: outside, behind
/// another surface (by 3 cm and six sigma of its depth), without colour.
RenderedCounts render_quarters(const KeyframeImage& keyframe, const Transform<Depth, Depth>& T_key_view,
                               std::span<const float> view_z_m, int row_begin, int row_end,
                               std::span<std::uint16_t> quarters) noexcept;
/// The same one pixel at a time, bit for bit: the oracle.
RenderedCounts render_quarters_reference(const KeyframeImage& keyframe, const Transform<Depth, Depth>& T_key_view,
                                         std::span<const float> view_z_m, int row_begin, int row_end,
                                         std::span<std::uint16_t> quarters) noexcept;
/// Brightness words of a whole rendering's rows; rows above and below must have been rendered.
void take_differences(std::span<const std::uint16_t> quarters, int width, int height, int row_begin, int row_end,
                      std::span<BrightnessWord> words) noexcept;

}  // namespace tactus::track
