#include "firmware_host/mesh_ply.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <vector>

#include "pipeline/evaluate/mesh.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tactus::firmware {
namespace {

struct Columns {
  std::vector<Vec3f> positions, normals;
  std::vector<Rgb8> colors;
  std::vector<MaterialId> labels;
  std::vector<float> confidences;
  explicit Columns(std::size_t count, std::size_t first = 0) {
    for (std::size_t i = first; i < first + count; ++i) {
      const auto v = static_cast<float>(i);
      positions.push_back({v, 2 * v, -v});
      normals.push_back({0, 1, 0});
      colors.push_back({static_cast<std::uint8_t>(i), 1, 2});
      labels.push_back(static_cast<MaterialId>(i % kMaterialCount));
      confidences.push_back(0.25F);
    }
  }
  [[nodiscard]] MeshVertices view() const { return {positions, normals, colors, labels, confidences}; }
};

TEST(MeshPly, IsReadBackAsWritten) {
  const test::TemporaryFolder folder;
  const auto file = folder.path() / "mesh.ply";
  auto sut = MeshPlyWriter::create(file);
  ASSERT_TRUE(sut.has_value());
  sut->append_vertices(Columns(700).view());  // more than one batch
  sut->append_vertices(Columns(300, 700).view());
  std::vector<std::array<std::uint32_t, 3>> triangles;
  for (std::uint32_t i = 0; i + 2 < 1000; ++i) triangles.push_back({i, i + 1, i + 2});
  sut->append_triangles(std::span(triangles).first(1));
  sut->append_triangles(std::span(triangles).subspan(1));
  ASSERT_TRUE(sut->close().has_value());

  const auto mesh = evaluate::read_ply(file);
  ASSERT_TRUE(mesh.has_value()) << mesh.error().message;
  const Columns expected(1000);
  EXPECT_EQ(mesh->vertices_m, expected.positions);
  EXPECT_EQ(mesh->vertex_labels, expected.labels);
  EXPECT_EQ(mesh->triangles, triangles);
}

TEST(MeshPly, BytesAreAsTheHeaderSays) {
  const test::TemporaryFolder folder;
  auto sut = MeshPlyWriter::create(folder.path() / "m.ply");
  ASSERT_TRUE(sut.has_value());
  const Columns one(1, 3);
  sut->append_vertices(one.view());
  ASSERT_TRUE(sut->close().has_value());
  const std::string bytes = folder.read("m.ply");
  const std::size_t body = bytes.find("end_header\n") + 11;
  ASSERT_EQ(bytes.size() - body, 32u);
  float values[6];
  std::memcpy(values, bytes.data() + body, sizeof(values));
  EXPECT_EQ(values[0], 3.0F);
  EXPECT_EQ(values[2], -3.0F);
  EXPECT_EQ(values[4], 1.0F);
  EXPECT_EQ(static_cast<unsigned char>(bytes[body + 24]), 3);  // red
  EXPECT_EQ(static_cast<unsigned char>(bytes[body + 27]), 3);  // label
  float confidence = 0;
  std::memcpy(&confidence, bytes.data() + body + 28, sizeof(confidence));
  EXPECT_EQ(confidence, 0.25F);
}

TEST(MeshPly, EmptyMeshClosesCleanly) {
  const test::TemporaryFolder folder;
  auto sut = MeshPlyWriter::create(folder.path() / "m.ply");
  ASSERT_TRUE(sut.has_value());
  ASSERT_TRUE(sut->close().has_value());
  EXPECT_NE(folder.read("m.ply").find("element vertex 0 "), std::string::npos);
}

TEST(MeshPly, VerticesAfterTrianglesAreABug) {
  const test::TemporaryFolder folder;
  auto sut = MeshPlyWriter::create(folder.path() / "m.ply");
  ASSERT_TRUE(sut.has_value());
  const Columns columns(3);
  sut->append_vertices(columns.view());
  const std::array<std::uint32_t, 3> triangle = {0, 1, 2};
  sut->append_triangles({&triangle, 1});
  EXPECT_DEATH(sut->append_vertices(columns.view()), "assertion failed");
}

}  // namespace
}  // namespace tactus::firmware
