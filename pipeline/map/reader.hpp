// Reading the labelled map while it is being written: any thread, no lock, never torn.
#pragma once

#include <cstdint>
#include <limits>
#include <span>

#include "hal/transform.hpp"
#include "pipeline/label/material.hpp"

namespace tactus::map {

class Map;

/// What Reader::distances() answers where distance() answers false.
inline constexpr float kUnknownDistanceM = std::numeric_limits<float>::infinity();

/// The signed distance field at a point, trilinearly interpolated.
struct DistanceSample {
  float distance_m = 0;  // positive in front of the surface; |distance| <= truncation
  Vec3f gradient;        // unit length, towards free space; zero where the field is flat
};

/// The map's answer about a piece of surface.
struct SurfacePoint {
  Vec3f position_world_m;
  Vec3f normal_world;                // unit, towards free space
  MaterialDistribution materials{};  // posterior, refined by the CRF where it has come by; uniform where unknown
  MaterialId material =
      kUnknownMaterial;  // most likely one; kUnknownMaterial where nothing has been labelled
  std::uint32_t label_age_frames =
      0;  // frames since a keyframe or a person last labelled this block; meaningless when unknown
  std::uint8_t label_observations = 0;  // keyframes fused into this cell, saturating
  bool is_pinned = false;               // the material is a person's word (pin_surface.hpp)
  Rgb8 color;
};

/// What a reader takes for a cell's material.
enum class LabelView : std::uint8_t {
  refined,  // what a person pinned; else what the CRF found, where it has come by; else as fused
  fused     // eq. (1) alone
};

/// A view of the live map for one reading thread. Cheap to copy. Every call is lock-free and bounded: a block
/// that the writer changes under the reader is read again up to a fixed number of times, then answers
/// "unknown" (false).
class Reader {
 public:
  explicit Reader(const Map& map, LabelView view = LabelView::refined) : map_(&map), view_(view) {}

  /// False where any of the eight voxels around the point was never observed: unseen space is not solid.
  [[nodiscard]] bool sample(const Vec3f& p_world_m, DistanceSample& out) const noexcept;

  /// As sample(), without the gradient: a third of the reads.
  [[nodiscard]] bool distance(const Vec3f& p_world_m, float& distance_m) const noexcept;

  /// As distance() at each of the points, in metres or kUnknownDistanceM; at least as many results as points.
  /// Cheaper for points of one neighbourhood: a block is looked up once, however many of them it
  /// holds.
  void distances(std::span<const Vec3f> points_world_m, std::span<float> distances_m) const noexcept;

  /// First surface along the ray (direction need not be unit), seen from its front, within range_m_max.
  [[nodiscard]] bool raycast(const Vec3f& origin_world_m, const Vec3f& direction_world, float range_m_max,
                             SurfacePoint& out) const noexcept;

  /// Nearest point of the zero level set around p, found by walking the distance field; false when p is
  /// farther than the truncation distance from any surface or in unseen space.
  [[nodiscard]] bool nearest_surface(const Vec3f& p_world_m, SurfacePoint& out) const noexcept;

  [[nodiscard]] float voxel_size_m() const noexcept;
  [[nodiscard]] float truncation_m() const noexcept;

 private:
  const Map* map_;
  LabelView view_;
};

}  // namespace tactus::map
