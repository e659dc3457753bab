// mesh.ply, written as it comes: no mesh in memory.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <span>

#include "firmware_host/output_file.hpp"
#include "hal/transform.hpp"
#include "pipeline/label/material.hpp"

namespace tactus::firmware {

/// As many of each; vertex i is element i of every span.
struct MeshVertices {
  std::span<const Vec3f> positions_world_m, normals_world;
  std::span<const Rgb8> colors;
  std::span<const MaterialId> labels;  // 255: unknown
  std::span<const float> confidences;  // probability of the label, 0..1
};

/// Binary little-endian PLY: x y z nx ny nz (float, metres) red green blue label (uchar) confidence (float),
/// then triangles. Any number of append_vertices(), then any number of append_triangles(), then close(),
/// which fills in the counts; a file that was not closed says it has no vertices.
class MeshPlyWriter {
 public:
  static rt::Result<MeshPlyWriter> create(const std::filesystem::path& file);

  void append_vertices(const MeshVertices& vertices);
  /// Indices count from the first vertex of the file, in the order appended.
  void append_triangles(std::span<const std::array<std::uint32_t, 3>> triangles);
  rt::Result<void> close();

  [[nodiscard]] std::uint64_t vertices_count() const { return vertices_count_; }
  [[nodiscard]] std::uint64_t triangles_count() const { return triangles_count_; }

 private:
  explicit MeshPlyWriter(OutputFile file) : file_(std::move(file)) {}
  void write_header();

  OutputFile file_;
  std::uint64_t vertices_count_ = 0, triangles_count_ = 0;
};

}  // namespace tactus::firmware
