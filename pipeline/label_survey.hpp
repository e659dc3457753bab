// What the map knows of the surface that the camera sees now: how much of it has a label, how well founded
// and how old, and how far it moved through the image. Sampled on a grid of 16x12 rays of the model view: the
// facts by which keyframes are chosen (segment/keyframe_policy.hpp).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "hal/calibration.hpp"
#include "pipeline/map/map.hpp"
#include "pipeline/map/predict.hpp"

namespace tactus {

inline constexpr int kSurveyColumns = 16, kSurveyRows = 12;
inline constexpr std::size_t kSurveySamples = std::size_t{kSurveyColumns} * std::size_t{kSurveyRows};
/// Shares are of the visible surface, but of a quarter of the image where there is less: a corner of new
/// surface in an empty view is not worth a keyframe.
inline constexpr std::size_t kSurveySurfaceMin = kSurveySamples / 4;

/// A keyframe whose labels are not in the map yet.
struct KeyframeUnderWay {
  T_WorldDepth T_world_depth;
  std::span<const float> half_depth_m;  // of the model view's camera; 0 where nothing was measured
};

struct LabelSurveyInput {
  const map::Map* map = nullptr;
  const map::ModelView* model = nullptr;
  /// As Spine::color_pixels(): surface that the colour camera does not see is left out. May be empty.
  std::span<const std::uint32_t> color_pixels;
  std::span<const KeyframeUnderWay> under_way;
  std::optional<T_WorldDepth> T_world_before;    // the frame before this one
  std::optional<T_WorldDepth> T_world_keyframe;  // the last keyframe
  std::uint32_t frame_index = 0;
  std::uint32_t weak_observations = 0;  // fewer are weak
  std::uint32_t old_frames = 0;         // labels of this age or older are old
};

/// Counts are of samples. Surface counts when a keyframe of this view could label it: seen at a cosine of 0.3
/// or more, by both cameras.
struct LabelSurvey {
  std::size_t surface_count = 0;
  std::size_t unlabelled_count = 0;  // no label in the map
  std::size_t new_count = 0;   // of these, those that the next keyframe would label: none under way has seen
                               // them, and none that labelled their block in the last 90 frames left them out
  std::size_t weak_count = 0;  // labelled, by few observations; one under way counts as made
  std::size_t old_count = 0;   // labelled long ago, and none under way has seen it
  std::uint64_t label_age_frames_sum = 0;  // over the labelled ones, by their block's newest label
  /// Mean ways of the surface through the half-resolution image, in its pixels, at most its width; nothing
  /// where the other pose or the surface is missing.
  std::optional<float> moved_half_px, moved_since_keyframe_half_px;

  [[nodiscard]] float share(std::size_t count) const noexcept {
    return static_cast<float>(count) /
           static_cast<float>(surface_count > kSurveySurfaceMin ? surface_count : kSurveySurfaceMin);
  }
};

/// Step; the map's writer thread, after predict; no heap, no lock; 25 us, 85 with cold caches. + - * / and
/// sqrt in a fixed order: the same on every machine.
[[nodiscard]] LabelSurvey survey_labels(const LabelSurveyInput& input) noexcept;

}  // namespace tactus
