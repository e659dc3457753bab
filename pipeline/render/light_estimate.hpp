// The room's light from its picture: what lamp and what hemisphere explain how bright surfaces are by how
// they face.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "hal/calibration.hpp"
#include "pipeline/render/light.hpp"
#include "rt/slice.hpp"
#include "rt/status.hpp"

namespace tactus::render {

struct LightView {
  std::span<const std::uint8_t> video_rgb;  // width * height * 3
  std::span<const float> depth_m;           // width * height; 0 or NaN: none
  hal::Intrinsics camera;                   // of both; no distortion
  T_WorldDepth T_world_depth;
};

/// Light seen in one picture. Every 8th pixel each way that is neither near black nor saturated gives a
/// normal (from depth 4 pixels around) and a linear colour (the square of the video's). Fitted is
///   I(n) = albedo (A + H n.up + m(n) b.n),   m = 1 where n faces the lamp, else 0,
/// first-order spherical harmonics with the shadowed side cut off (Ramamoorthi and Hanrahan 2001), per
/// channel, in 4 rounds: two find the lamp's side, two more weigh down what does not fit (Cauchy;
/// shadows, gloss, odd albedo). Albedo is not seen apart from light: it is taken to be kMeanAlbedo on average
/// and independent of how a surface faces. A room whose walls are brighter than its floor for their paint
/// alone looks lit from the side.
struct LightFit {
  Light light;
  int samples_count = 0;
  /// Harmonic mean of the eigenvalues of mean(n n^T) over 3: between a third of the smallest and the smallest.
  /// 1/9 for all directions alike, 0 for one or two walls.
  float spread = 0;
};
inline constexpr float kMeanAlbedo = 0.5F;
inline constexpr int kLightSamplesMin = 200;
inline constexpr float kLightSpreadMin = 0.01F;

struct LightSample {
  Vec3f normal_world;
  Vec3f color;  // linear
};

/// How many samples a picture of this camera can give. Pure.
std::size_t light_samples_max(const hal::Intrinsics& camera);

/// Pure; no heap; O(pixels / 64); any phase. `samples` is scratch for light_samples_max() of them. ok |
/// skipped (too few samples, or their normals do not span all three directions: `fit.light` is the default
/// one).
rt::Status fit_light(const LightView& view, std::span<LightSample> samples, LightFit& fit) noexcept;

/// What of a fit pictures are lit by. Nothing real stands in the way of virtual shadows, so a lamp near the horizon, a
/// window, would throw them through furniture across the room: it is raised to where most of what it reaches lies close
/// by. And a red kitchen is red by its paint, not by its lamps: channels keep within kLightChromaMax of grey, and a shadow
/// keeps kAmbientLeast of the light. Pure.
Light believable(const Light& seen) noexcept;
inline constexpr float kLightElevationMin = 0.643F;  // sine of 40 degrees
inline constexpr float kLightChromaMax = 0.2F;
inline constexpr float kAmbientLeast = 0.5F;

/// The light over time: fits drawn in with a time constant of kLightSettleS; the default one until the first
/// fit. Pictures that cannot tell leave it as it is. One thread.
class LightEstimate {
 public:
  static std::size_t bytes_needed(const hal::Intrinsics& camera);
  void bind(const hal::Intrinsics& camera, rt::Slice slice);  // boot, once

  /// Step; `interval_s` since the last call. Answers what fit_light said.
  rt::Status step(const LightView& view, float interval_s) noexcept;

  [[nodiscard]] const Light& light() const { return light_; }

 private:
  std::span<LightSample> samples_;
  Light seen_, light_;  // as fitted; as believed
  bool has_fit_ = false;
};
inline constexpr float kLightSettleS = 1;

}  // namespace tactus::render
