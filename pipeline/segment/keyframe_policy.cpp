#include "pipeline/segment/keyframe_policy.hpp"

#include <algorithm>

namespace tactus::segment {

float keyframe_need(const KeyframeRules& rules, const KeyframeFacts& facts) noexcept {
  // The network would say of the same view what it said before: without another one, more is not known.
  const float other_view = std::min(1.0f, facts.view_change_share / rules.view_change_share);
  return facts.new_share / rules.new_share + facts.weak_share / rules.weak_share * other_view +
         facts.old_share / rules.old_share;
}

KeyframeVerdict judge_keyframe(const KeyframeRules& rules, const KeyframeFacts& facts) noexcept {
  if (rules.policy == KeyframePolicy::every)
    return !facts.frames_since_last || *facts.frames_since_last >= rules.every_frames
               ? KeyframeVerdict::take
               : KeyframeVerdict::not_needed;
  if (facts.frames_since_last && *facts.frames_since_last < rules.gap_min_frames)
    return KeyframeVerdict::not_needed;
  if (!(keyframe_need(rules, facts) >= 1.0f)) return KeyframeVerdict::not_needed;
  // A session's first frame has none before it to measure motion by; later, the next frame will know.
  const bool is_sharp = facts.motion_px ? *facts.motion_px * rules.exposure_share <= rules.blur_max_px
                                        : !facts.frames_since_last;
  return is_sharp || facts.frames_waited >= rules.wait_max_frames ? KeyframeVerdict::take
                                                                  : KeyframeVerdict::wait;
}

}  // namespace tactus::segment
