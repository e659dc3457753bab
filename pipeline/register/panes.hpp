// Mirrors and panes. A depth camera gets nothing back from them: without more, the map has a hole there, a ball flies
// through the wardrobe, and the network's word "mirror" falls on nothing. What surrounds such a hole is mostly the frame
// that holds it, in its plane (Mirror3D, Tan et al. 2021, fits the mirror's plane to its border for the same reason): a
// hole whose border lies in one plane is closed by that plane.
//
// What is not a pane and must stay open: the shadow a near thing throws on what is behind it (its two borders lie in no
// common plane; the slanted one through both continues neither), what is out of range, holes cut off by the picture's edge,
// openings through which anything was measured behind the plane. A wrong pane across an opening is carved away by the
// first frames that measure through it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "hal/calibration.hpp"
#include "rt/slice.hpp"

namespace tactus {

/// A measurement on the ray (ray_x, ray_y, 1). Structured light measures 1 / z with the same noise everywhere, so that
/// planes are fitted there.
struct InverseDepth {
  double ray_x, ray_y, inverse_z, tolerance;
};

/// A plane in a camera's frame: 1 / z = (x, y, one) . (ray_x, ray_y, 1).
struct InversePlane {
  double x = 0, y = 0, one = 0;
  [[nodiscard]] double inverse_z_at(double ray_x, double ray_y) const { return x * ray_x + y * ray_y + one; }
  [[nodiscard]] double behind(const InverseDepth& p) const { return inverse_z_at(p.ray_x, p.ray_y) - p.inverse_z; }
  [[nodiscard]] bool holds(const InverseDepth& p) const { return behind(p) <= p.tolerance && behind(p) >= -p.tolerance; }
};

/// Whether a half-resolution pixel belongs to a pane; `pane_bits` as PaneFiller::pane_bits() has them, empty: none does.
/// Any phase, any thread.
[[nodiscard]] inline bool is_pane(std::span<const std::uint64_t> pane_bits, std::size_t half_pixel) {
  return !pane_bits.empty() && (pane_bits[half_pixel / 64] >> (half_pixel % 64) & 1u) != 0;
}

class PaneFiller {
 public:
  /// `full`: an ideal camera (no distortion), sides multiples of 4.
  static std::size_t bytes_needed(const hal::Intrinsics& full);
  void bind(rt::Slice& memory, const hal::Intrinsics& full);

  /// Closes the panes among the holes of `depth` (kDepthUnitM); measured pixels are never changed. Returns the
  /// half-resolution image with the panes in it: `half_m` itself when there are none, else a copy that lasts until the
  /// next call (tracking has no use for panes: nothing is ever measured on them). Step; one thread; no heap; work is
  /// bounded by the image and kPanesMax. Equal images give equal bits.
  std::span<const float> fill(std::span<std::uint16_t> depth, std::span<const float> half_m) noexcept;
  /// Forgets the last frame's panes.
  void clear() noexcept;

  [[nodiscard]] int panes_count() const noexcept { return panes_count_; }
  /// One bit per half-resolution pixel of a pane, closed by the last fill() or measured on the pane inside the hole; 64 to
  /// a word from the lowest.
  [[nodiscard]] std::span<const std::uint64_t> pane_bits() const noexcept { return pane_bits_; }
  static constexpr std::size_t pane_words_count(const hal::Intrinsics& full) {
    return (static_cast<std::size_t>(full.width / 2) * static_cast<std::size_t>(full.height / 2) + 63) / 64;
  }

  static constexpr int kPanesMax = 8;  // a frame

 private:
  using Tile = std::uint16_t;  // 4x4 pixels; index by rows
  enum class Kind : std::uint8_t { mixed, measured, hole, seen, stray };  // seen: a hole's, looked at
  struct BorderPoint {
    InverseDepth point;
    bool is_outer;
  };
  struct Range {
    double nearest, farthest;  // inverse z
  };

  [[nodiscard]] double ray_x_of(Tile tile) const noexcept;  // of its centre
  [[nodiscard]] double ray_y_of(Tile tile) const noexcept;
  [[nodiscard]] InverseDepth measurement_of(Tile tile) const noexcept;  // of a tile that has some
  void classify(std::span<const std::uint16_t> depth) noexcept;
  [[nodiscard]] bool is_island(int x, int y) const noexcept;
  void flood(Tile first) noexcept;
  void add_border(Tile tile) noexcept;
  [[nodiscard]] bool find_plane(InversePlane& plane) const noexcept;
  [[nodiscard]] bool border_is_of(const InversePlane& plane, Range& border) const noexcept;
  [[nodiscard]] bool hole_is_pane(const Range& border, InversePlane& plane) const noexcept;
  void close(const InversePlane& plane, std::span<std::uint16_t> depth) noexcept;

  hal::Intrinsics full_;
  double inverse_fx_ = 0, inverse_fy_ = 0;
  int tiles_x_ = 0, tiles_y_ = 0;
  std::span<Kind> kind_;
  std::span<float> tile_m_;             // tile_means()
  std::span<std::uint16_t> border_of_;  // number of the hole whose border the tile is already in
  std::span<Tile> hole_;                // the tiles of the hole being looked at
  std::span<BorderPoint> border_;
  std::span<std::uint64_t> pane_bits_;
  std::span<float> closed_half_m_;
  std::size_t hole_count_ = 0, border_count_ = 0, contacts_count_ = 0, edge_contacts_count_ = 0;
  std::uint16_t hole_number_ = 0;
  int panes_count_ = 0;
};

}  // namespace tactus
