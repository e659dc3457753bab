// Which frames go to the network.
//
//   every      one frame in N (N = 12: the paper's trade-off between speed and accuracy, sec. IV-B)
//   adaptive   by need: where surface without label comes into view, where labels rest on few observations
//   and
//              the view is another one by now, where they are old; and when the image is sharp
//
// The adaptive need is a sum of shares, each over what is enough alone: one is enough, and so are two halves.
// A frame that is needed but blurred by motion waits for a sharper one, a bounded number of frames.
#pragma once

#include <cstdint>
#include <optional>

namespace tactus::segment {

enum class KeyframePolicy : std::uint8_t { every, adaptive };

struct KeyframeRules {
  KeyframePolicy policy = KeyframePolicy::every;
  std::uint32_t every_frames = 12;

  // Adaptive. Chosen on the synthetic rooms (`tactus study keyframes`).
  // Between two. Fusing one takes about eight frames: with a gap of six they queue, and more keyframes leave
  // more of what is in view unlabelled.
  std::uint32_t gap_min_frames = 10;
  std::uint32_t wait_max_frames = 6;  // for a sharper image
  float new_share = 0.06f;            // of the visible surface, without label: enough alone
  float weak_share = 0.60f;           // labelled by fewer than weak_observations: enough alone, once the view
                                      // has changed by view_change_share
  float old_share = 0.50f;            // labelled old_frames ago or earlier: enough alone
  std::uint32_t weak_observations = 4;
  std::uint32_t old_frames = 300;   // 10 s at 30 Hz
  float view_change_share = 0.10f;  // of the image's width: another view of the same surface
  float blur_max_px = 4.0f;         // of the colour image; at 640 pixels the network halves what is finer
  float exposure_share = 0.5f;      // of the frame's period: 1/60 s, a room by lamplight
};

/// What is known of a frame before it is decided upon. Shares are of the visible surface (label_survey.hpp).
struct KeyframeFacts {
  std::optional<std::uint32_t> frames_since_last;  // keyframe; nothing: this would be the first
  std::uint32_t frames_waited = 0;                 // since the first `wait` in a row
  float new_share = 0;                             // without label, and no keyframe under way has seen it
  float weak_share = 0;                            // with fewer than weak_observations
  float old_share = 0;                             // with a label of old_frames or older
  float view_change_share =
      0;  // mean way of the surface through the image since the last keyframe, over its width
  std::optional<float> motion_px;  // mean way since the frame before, in colour pixels; nothing: not known
};

enum class KeyframeVerdict : std::uint8_t {
  not_needed,
  wait,  // needed, but blurred
  take
};

/// How much a keyframe is needed; 1 is enough. Never falls when a share grows. Any phase, any thread.
[[nodiscard]] float keyframe_need(const KeyframeRules& rules, const KeyframeFacts& facts) noexcept;

/// The decision: + - * / and comparisons of its arguments alone, the same on every machine. Any phase, any
/// thread.
[[nodiscard]] KeyframeVerdict judge_keyframe(const KeyframeRules& rules, const KeyframeFacts& facts) noexcept;

}  // namespace tactus::segment
