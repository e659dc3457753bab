// Meshes of other programs: whatever the file, every index of an accepted mesh is in range and every
// coordinate finite.
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "pipeline/evaluate/mesh.hpp"
#include "rt/assert.hpp"
#include "tests/fuzz/memory_file.hpp"

using namespace tactus;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t bytes) {
  static test::MemoryFile file;
  const auto mesh = evaluate::read_ply(file.holding(data, bytes));
  if (!mesh) {
    TACTUS_ASSERT(mesh.error().code == rt::ExitCode::bad_input && !mesh.error().message.empty());
    return 0;
  }
  const evaluate::Mesh& read = mesh.value();
  for (const Vec3f& v : read.vertices_m)
    TACTUS_ASSERT(std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z));
  for (const auto& triangle : read.triangles)
    for (const std::uint32_t corner : triangle) TACTUS_ASSERT(corner < read.vertices_m.size());
  TACTUS_ASSERT(read.vertex_labels.empty() || read.vertex_labels.size() == read.vertices_m.size());
  TACTUS_ASSERT(read.triangle_labels.empty() || read.triangle_labels.size() == read.triangles.size());
  for (std::size_t i = 0; i < read.triangles.size(); ++i) static_cast<void>(read.triangle_label(i));
  return 0;
}
