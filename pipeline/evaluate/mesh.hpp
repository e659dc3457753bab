// Triangle meshes out of PLY files, ours (mesh.ply) and other programs'.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "hal/transform.hpp"
#include "pipeline/label/material.hpp"
#include "rt/status.hpp"

namespace tactus::evaluate {

struct Mesh {
  std::vector<Vec3f> vertices_m;
  std::vector<std::array<std::uint32_t, 3>>
      triangles;                            // indices into vertices_m, all in range; empty: a point cloud
  std::vector<MaterialId> vertex_labels;    // per vertex, or empty
  std::vector<MaterialId> triangle_labels;  // per triangle, or empty

  /// Of a triangle: its own label, else the one that most of its corners carry, else unknown.
  [[nodiscard]] MaterialId triangle_label(std::size_t triangle) const;
};

/// Reads ascii, binary_little_endian and binary_big_endian PLY: element `vertex` with scalar x y z (metres)
/// and optionally `label`; element `face` with a list vertex_indices (or vertex_index) and optionally a
/// scalar `label`. Polygons become fans. Other elements and properties are skipped. bad_input, naming the
/// file and what is wrong, when the header is not understood, the file is shorter than its header says, a
/// coordinate is not finite or an index is out of range. Command line only: allocates.
rt::Result<Mesh> read_ply(const std::filesystem::path& file);

}  // namespace tactus::evaluate
