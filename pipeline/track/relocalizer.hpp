// Where am I? A fixed number of keyframes, each a tiny image of depth and brightness with its pose, searched
// when lost.
//
// A keyframe is added while tracking goes well and the view differs from every stored one (nearest in pose:
// 0.3 m or 20 degrees). When the store is full the keyframe that is nearest to its neighbour in pose gives
// way (it says least). After Glocker et al. 2015 (small images as keys), by direct comparison instead of
// ferns: 64 images of 40x30 are 150 KB and take 0.1 ms to compare.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "hal/calibration.hpp"
#include "hal/transform.hpp"
#include "rt/slice.hpp"

namespace tactus::track {

struct RelocalizerConfig {
  std::uint32_t keyframes_capacity = 64;
  double new_shift_m = 0.3;
  double new_turn = 0.35;  // radians
};

class Relocalizer {
 public:
  static constexpr int kWidth = 40, kHeight = 30;
  static constexpr int kProposalsMax = 4;
  static std::size_t bytes_needed(const RelocalizerConfig& config);
  void bind(rt::Slice& memory, const RelocalizerConfig& config);

  /// Makes the key of a frame; half_color may be empty. Step.
  void observe(std::span<const float> half_m, std::span<const std::uint32_t> half_color,
               const hal::Intrinsics& half_camera) noexcept;
  /// Stores the observed frame if it adds something. Step, O(capacity).
  void remember(const T_WorldDepth& T_world_depth) noexcept;

  struct Proposal {
    T_WorldDepth T_world_depth;
    float difference = 0;  // mean absolute difference of the keys, 0 = identical
  };
  /// The stored poses that look most like the observed frame, best first.
  [[nodiscard]] std::span<const Proposal> propose() noexcept;

  [[nodiscard]] std::uint32_t keyframes_count() const noexcept { return count_; }

 private:
  static constexpr std::size_t kKeyPixels = std::size_t{kWidth} * kHeight;
  struct Key {
    std::array<std::uint8_t, kKeyPixels> depth;       // 1..255: inverse depth, 0 unknown
    std::array<std::uint8_t, kKeyPixels> brightness;  // 0 unknown
  };
  static float difference(const Key& a, const Key& b) noexcept;

  RelocalizerConfig config_;
  std::span<Key> keys_;
  std::span<T_WorldDepth> poses_;
  Key observed_{};
  std::uint32_t count_ = 0;
  std::array<Proposal, kProposalsMax> proposals_{};
};

}  // namespace tactus::track
