#include "firmware_host/mesh_ply.hpp"

#include <bit>
#include <cinttypes>
#include <cstring>

namespace tactus::firmware {
namespace {

// Records are memory images: little-endian hosts only, which all our targets are.
static_assert(std::endian::native == std::endian::little);

#pragma pack(push, 1)
struct VertexRecord {
  Vec3f position, normal;
  std::uint8_t red, green, blue, label;
  float confidence;
};
struct TriangleRecord {
  std::uint8_t count = 3;
  std::array<std::uint32_t, 3> indices;
};
#pragma pack(pop)
static_assert(sizeof(VertexRecord) == 32);
static_assert(sizeof(TriangleRecord) == 13);

}  // namespace

rt::Result<MeshPlyWriter> MeshPlyWriter::create(const std::filesystem::path& path) {
  auto file = OutputFile::create(path);
  if (!file) return file.error();
  MeshPlyWriter writer(std::move(*file));
  writer.write_header();
  return writer;
}

void MeshPlyWriter::write_header() {
  // Counts are padded to 20 characters, the longest 64-bit number, so that the header can be rewritten in
  // place.
  file_.print(
      "ply\nformat binary_little_endian 1.0\ncomment tactus: metres, y up; label = material id, 255 unknown\n"
      "element vertex %-20" PRIu64 "\n",
      vertices_count_);
  for (const char* name : {"x", "y", "z", "nx", "ny", "nz"}) file_.print("property float %s\n", name);
  for (const char* name : {"red", "green", "blue", "label"}) file_.print("property uchar %s\n", name);
  file_.print("property float confidence\nelement face %-20" PRIu64
              "\nproperty list uchar int vertex_indices\n"
              "end_header\n",
              triangles_count_);
}

void MeshPlyWriter::append_vertices(const MeshVertices& v) {
  const std::size_t count = v.positions_world_m.size();
  TACTUS_ASSERT(triangles_count_ == 0);
  TACTUS_ASSERT(v.normals_world.size() == count && v.colors.size() == count && v.labels.size() == count &&
                v.confidences.size() == count);
  std::array<VertexRecord, 512> batch;
  for (std::size_t first = 0; first < count; first += batch.size()) {
    const std::size_t batch_count = std::min(batch.size(), count - first);
    for (std::size_t k = 0; k < batch_count; ++k) {
      const std::size_t i = first + k;
      const Rgb8 c = v.colors[i];
      batch[k] = {v.positions_world_m[i], v.normals_world[i], c.r, c.g, c.b, v.labels[i], v.confidences[i]};
    }
    file_.write(batch.data(), batch_count * sizeof(VertexRecord));
  }
  vertices_count_ += count;
}

void MeshPlyWriter::append_triangles(std::span<const std::array<std::uint32_t, 3>> triangles) {
  std::array<TriangleRecord, 1024> batch;
  for (std::size_t first = 0; first < triangles.size(); first += batch.size()) {
    const std::size_t batch_count = std::min(batch.size(), triangles.size() - first);
    for (std::size_t k = 0; k < batch_count; ++k) batch[k] = {3, triangles[first + k]};
    file_.write(batch.data(), batch_count * sizeof(TriangleRecord));
  }
  triangles_count_ += triangles.size();
}

rt::Result<void> MeshPlyWriter::close() {
  file_.seek(0);
  write_header();
  return file_.close();
}

}  // namespace tactus::firmware
