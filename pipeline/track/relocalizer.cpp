#include "pipeline/track/relocalizer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "pipeline/track/tracker.hpp"

namespace tactus::track {
namespace {

constexpr float kNearestM = 0.4f;     // inverse depth of 0.4 m is 255
constexpr float kMatchedMin = 0.25f;  // of the key's pixels known in both; below, nothing can be said

// A shift of a metre counts like a turn of a radian: both move most of the view out of the image.
double pose_distance(const T_WorldDepth& a, const T_WorldDepth& b) {
  return (a.translation - b.translation).norm() + small_angle(a.rotation.transposed() * b.rotation);
}

}  // namespace

std::size_t Relocalizer::bytes_needed(const RelocalizerConfig& config) {
  return rt::bytes_of<Key>(config.keyframes_capacity) + rt::bytes_of<T_WorldDepth>(config.keyframes_capacity);
}

void Relocalizer::bind(rt::Slice& memory, const RelocalizerConfig& config) {
  TACTUS_ASSERT(config.keyframes_capacity >= 2);
  config_ = config;
  keys_ = memory.take<Key>(config.keyframes_capacity);
  poses_ = memory.take<T_WorldDepth>(config.keyframes_capacity);
}

void Relocalizer::observe(std::span<const float> half_m, std::span<const std::uint32_t> half_color,
                          const hal::Intrinsics& half_camera) noexcept {
  const int step_x = half_camera.width / kWidth, step_y = half_camera.height / kHeight;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      // Means over the tile's middle quarter: four by four of eight by eight pixels at 320x240.
      float depth = 0, depth_count = 0;
      std::uint32_t brightness = 0, brightness_count = 0;
      for (int j = step_y / 4; j < step_y - step_y / 4; ++j)
        for (int i = step_x / 4; i < step_x - step_x / 4; ++i) {
          const auto pixel =
              static_cast<std::size_t>(y * step_y + j) * static_cast<std::size_t>(half_camera.width) +
              static_cast<std::size_t>(x * step_x + i);
          if (half_m[pixel] > 0) {
            depth += half_m[pixel];
            depth_count += 1;
          }
          if (!half_color.empty() && half_color[pixel] >> 24 != 0) {
            const std::uint32_t c = half_color[pixel];
            brightness += ((c & 255u) + 2 * (c >> 8 & 255u) + (c >> 16 & 255u)) / 4;
            ++brightness_count;
          }
        }
      const auto at = static_cast<std::size_t>(y * kWidth + x);
      const float inverse = depth_count > 0 ? 255.0f * kNearestM * depth_count / depth : 0.0f;
      observed_.depth[at] =
          depth_count > 0 ? static_cast<std::uint8_t>(std::clamp(inverse, 1.0f, 255.0f)) : std::uint8_t{0};
      observed_.brightness[at] = brightness_count > 0
                                     ? static_cast<std::uint8_t>(std::max(1u, brightness / brightness_count))
                                     : std::uint8_t{0};
    }
}

float Relocalizer::difference(const Key& a, const Key& b) noexcept {
  std::int32_t depth = 0, depth_count = 0, brightness = 0, brightness_count = 0;
  for (std::size_t i = 0; i < kKeyPixels; ++i) {
    const bool both_depth = a.depth[i] != 0 && b.depth[i] != 0;
    depth += both_depth ? std::abs(a.depth[i] - b.depth[i]) : 0;
    depth_count += both_depth;
    const bool both_brightness = a.brightness[i] != 0 && b.brightness[i] != 0;
    brightness += both_brightness ? std::abs(a.brightness[i] - b.brightness[i]) : 0;
    brightness_count += both_brightness;
  }
  if (static_cast<float>(depth_count) < kMatchedMin * static_cast<float>(kKeyPixels))
    return std::numeric_limits<float>::max();
  const float by_depth = static_cast<float>(depth) / static_cast<float>(depth_count);
  const float by_brightness =
      brightness_count > 0 ? static_cast<float>(brightness) / static_cast<float>(brightness_count) : 0.0f;
  return by_depth + 0.5f * by_brightness;
}

void Relocalizer::remember(const T_WorldDepth& T_world_depth) noexcept {
  const double enough = std::min(config_.new_shift_m, config_.new_turn);
  double nearest = std::numeric_limits<double>::max();
  for (std::uint32_t i = 0; i < count_; ++i)
    nearest = std::min(nearest, pose_distance(poses_[i], T_world_depth));
  if (nearest < enough) return;
  std::uint32_t slot = count_;
  if (count_ == config_.keyframes_capacity) {
    // Replace the one that is nearest to another: O(capacity^2) = 4096 distances, 60 us, on rare frames.
    double crowded = std::numeric_limits<double>::max();
    for (std::uint32_t i = 0; i < count_; ++i)
      for (std::uint32_t j = 0; j < i; ++j)
        if (const double d = pose_distance(poses_[i], poses_[j]); d < crowded) {
          crowded = d;
          slot = i;
        }
    if (crowded >= nearest) return;  // the stored ones are spread better than with this one
  } else {
    ++count_;
  }
  keys_[slot] = observed_;
  poses_[slot] = T_world_depth;
}

std::span<const Relocalizer::Proposal> Relocalizer::propose() noexcept {
  std::size_t found = 0;
  for (std::uint32_t i = 0; i < count_; ++i) {
    const float d = difference(keys_[i], observed_);
    if (d == std::numeric_limits<float>::max()) continue;
    std::size_t place = found;
    while (place > 0 && proposals_[place - 1].difference > d) --place;
    if (place >= kProposalsMax) continue;
    const std::size_t last = std::min<std::size_t>(found, kProposalsMax - 1);
    for (std::size_t j = last; j > place; --j) proposals_[j] = proposals_[j - 1];
    proposals_[place] = {poses_[i], d};
    found = std::min<std::size_t>(found + 1, kProposalsMax);
  }
  return {proposals_.data(), found};
}

}  // namespace tactus::track
