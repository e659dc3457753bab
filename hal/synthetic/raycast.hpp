// First hit of every pixel's ray with the room.
//
// Image tiles of 16x16 pixels; solids are listed front to back once a frame with a rectangle each in
// normalised image coordinates, so that a tile tests only solids that can be seen in it and stops when all
// its pixels are nearer than the next solid begins. Boxes, spheres and cylinders are intersected in closed
// form; the other solids by stepping along the ray with their exact distance, closing in by secants. Double
// precision in SIMD lanes (Highway), the same operations in the same order in every lane width: the same bits
// on every machine.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "hal/calibration.hpp"
#include "hal/synthetic/scene.hpp"

namespace tactus::hal::synthetic {

inline constexpr std::uint16_t kNoPrimitive = 0xffff;
inline constexpr int kTileSide = 16;
inline constexpr int kTilePixels = kTileSide * kTileSide;

/// What one camera sees in one frame, row-major planes.
struct Hits {
  std::vector<float> depth_m;            // z; 0 where nothing is hit
  std::vector<std::uint16_t> primitive;  // index of the solid, kNoPrimitive where nothing is hit
  std::vector<std::uint8_t>
      face;  // of a sharp box: 1 + 2 * axis + (1 on the positive side); 0 on other solids
  std::vector<float> normal_x, normal_y, normal_z;  // world frame, unit; filled by find_normals()

  explicit Hits(std::size_t pixels_count)
      : depth_m(pixels_count),
        primitive(pixels_count),
        face(pixels_count),
        normal_x(pixels_count),
        normal_y(pixels_count),
        normal_z(pixels_count) {}
  [[nodiscard]] std::size_t pixels_count() const { return depth_m.size(); }
};

/// The normalised coordinates (x, y at z = 1) that every pixel looks along; undoes the lens distortion.
class PixelRays {
 public:
  /// Boot; allocates 16 bytes a pixel when there is distortion, 8 bytes a row and column else.
  explicit PixelRays(const Intrinsics& intrinsics);
  [[nodiscard]] double x(int column, int row) const {
    return has_table_ ? x_[index(column, row)] : x_[at(column)];
  }
  [[nodiscard]] double y(int column, int row) const {
    return has_table_ ? y_[index(column, row)] : y_[at(row)];
  }
  /// One row in single precision; both spans have width() elements.
  void copy_row(int row, std::span<float> x, std::span<float> y) const;
  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  [[nodiscard]] double focal_px() const { return focal_px_; }

 private:
  static std::size_t at(int i) { return static_cast<std::size_t>(i); }
  [[nodiscard]] std::size_t index(int column, int row) const { return at(row) * at(width_) + at(column); }
  int width_, height_;
  double focal_px_;
  bool has_table_;
  std::vector<double> x_, y_;
};

/// One camera's view of a scene. Not thread-safe (scratch); the scene must outlive it.
class Raycaster {
 public:
  /// Boot; allocates.
  Raycaster(const Scene& scene, const Intrinsics& intrinsics);

  /// First hits of every pixel's ray, without normals. The camera must be outside of all solids. Step: no
  /// heap.
  void cast(const T_WorldDepth& T_world_camera, Hits& hits);
  /// Fills the normals of what cast() found with the same pose. Step: no heap.
  void find_normals(const T_WorldDepth& T_world_camera, Hits& hits) const;

  [[nodiscard]] const PixelRays& rays() const { return rays_; }

 private:
  struct Seen {
    double z_min_m;
    double x_min, x_max, y_min, y_max;  // bounds in normalised coordinates
    std::uint16_t primitive;
  };
  bool find_bounds(const Primitive& primitive, const T_WorldDepth& T_world_camera, Seen& seen) const;

  const Scene* scene_;
  PixelRays rays_;
  std::vector<Seen> seen_;
};

}  // namespace tactus::hal::synthetic
