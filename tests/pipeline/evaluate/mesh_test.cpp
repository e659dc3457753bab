#include "pipeline/evaluate/mesh.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cstring>
#include <string>

#include "tests/support/temporary_folder.hpp"

namespace tactus::evaluate {
namespace {

constexpr std::string_view kAsciiQuad =
    "ply\nformat ascii 1.0\ncomment made by hand\nelement vertex 4\nproperty float x\nproperty float y\n"
    "property float z\nproperty uchar label\nelement face 1\nproperty list uchar int vertex_indices\n"
    "property uchar label\nend_header\n0 0 0 3\n1 0 0 3\n1 1 0 22\n0 1 0 99\n4 0 1 2 3 6\n";

class Ply : public ::testing::Test {
 protected:
  rt::Result<Mesh> read(std::string_view bytes) { return read_ply(folder_.write("m.ply", bytes)); }
  std::string error_of(std::string_view bytes) {
    const auto mesh = read(bytes);
    if (mesh) return "no error";
    EXPECT_EQ(mesh.error().code, rt::ExitCode::bad_input);
    EXPECT_NE(mesh.error().message.find("m.ply"), std::string::npos);
    return mesh.error().message;
  }
  test::TemporaryFolder folder_;
};

/// The same quad in binary, either byte order, with a double, an unknown element and unknown properties in
/// between.
std::string binary_quad(bool is_big) {
  std::string bytes =
      std::string("ply\nformat binary_") + (is_big ? "big" : "little") +
      "_endian 1.0\nelement camera 2\nproperty list uchar short k\nelement vertex 4\nproperty double x\n"
      "property float y\nproperty float z\nproperty uchar red\nelement face 1\n"
      "property list uint uint vertex_index\nend_header\n";
  const auto put = [&](auto value) {
    char raw[sizeof(value)];
    std::memcpy(raw, &value, sizeof(value));
    for (std::size_t i = 0; i < sizeof(value); ++i) bytes += raw[is_big ? sizeof(value) - 1 - i : i];
  };
  put(std::uint8_t{2}), put(std::int16_t{-5}), put(std::int16_t{7}), put(std::uint8_t{0});
  const float xs[] = {0, 1, 1, 0}, ys[] = {0, 0, 1, 1};
  for (int i = 0; i < 4; ++i) put(static_cast<double>(xs[i])), put(ys[i]), put(0.25F), put(std::uint8_t{200});
  put(std::uint32_t{4}), put(std::uint32_t{0}), put(std::uint32_t{1}), put(std::uint32_t{2}),
      put(std::uint32_t{3});
  return bytes;
}

TEST_F(Ply, AsciiQuadBecomesTwoTriangles) {
  const auto mesh = read(kAsciiQuad);
  ASSERT_TRUE(mesh.has_value()) << mesh.error().message;
  ASSERT_EQ(mesh->vertices_m.size(), 4u);
  EXPECT_EQ(mesh->vertices_m[2], (Vec3f{1, 1, 0}));
  ASSERT_EQ(mesh->triangles.size(), 2u);
  EXPECT_EQ(mesh->triangles[1], (std::array<std::uint32_t, 3>{0, 2, 3}));
  EXPECT_EQ(mesh->vertex_labels, (std::vector<MaterialId>{3, 3, 22, kUnknownMaterial}));
  EXPECT_EQ(mesh->triangle_label(1), 6);
}

TEST_F(Ply, BothByteOrdersGiveTheSameMesh) {
  for (const bool is_big : {false, true}) {
    const auto mesh = read(binary_quad(is_big));
    ASSERT_TRUE(mesh.has_value()) << mesh.error().message;
    ASSERT_EQ(mesh->vertices_m.size(), 4u);
    EXPECT_EQ(mesh->vertices_m[1], (Vec3f{1, 0, 0.25F}));
    ASSERT_EQ(mesh->triangles.size(), 2u);
    EXPECT_EQ(mesh->triangles[0], (std::array<std::uint32_t, 3>{0, 1, 2}));
    EXPECT_TRUE(mesh->vertex_labels.empty());
    EXPECT_EQ(mesh->triangle_label(0), kUnknownMaterial);
  }
}

TEST_F(Ply, TriangleLabelIsTheMajorityOfItsCorners) {
  Mesh mesh;
  mesh.vertices_m.resize(3);
  mesh.triangles = {{0, 1, 2}};
  for (const auto& labels : {std::vector<MaterialId>{5, 5, 7}, {5, 7, 5}, {7, 5, 5}}) {
    mesh.vertex_labels = labels;
    EXPECT_EQ(mesh.triangle_label(0), 5);
  }
}

TEST_F(Ply, EveryPrefixOfAFileIsRefusedWithoutHarm) {
  // The last 1 byte of the ASCII file is the final newline, whose absence is no loss.
  for (std::size_t length = 0; length + 2 < kAsciiQuad.size(); ++length)
    EXPECT_FALSE(read(kAsciiQuad.substr(0, length)).has_value()) << length;
  const std::string binary = binary_quad(false);
  for (std::size_t length = 0; length < binary.size(); ++length)
    EXPECT_FALSE(read(std::string_view(binary).substr(0, length)).has_value()) << length;
}

TEST_F(Ply, LiesInTheHeaderAreSentences) {
  const auto with = [](std::string_view from, std::string_view to) {
    std::string s(kAsciiQuad);
    s.replace(s.find(from), from.size(), to);
    return s;
  };
  EXPECT_NE(error_of("solid stl\n").find("not a PLY"), std::string::npos);
  EXPECT_NE(error_of(with("ascii", "utf8")).find("format"), std::string::npos);
  EXPECT_NE(error_of(with("vertex 4", "vertex 18446744073709551615")).find("ends"), std::string::npos);
  EXPECT_NE(error_of(with("vertex 4", "vertex -4")).find("count"), std::string::npos);
  EXPECT_NE(error_of(with("float x", "float u")).find("x, y and z"), std::string::npos);
  EXPECT_NE(error_of(with("float x", "half x")).find("type"), std::string::npos);
  EXPECT_NE(error_of(with("0 1 2 3 6", "0 1 2 4 6")).find("does not exist"), std::string::npos);
  EXPECT_NE(error_of(with("0 1 2 3 6", "0 1 -1 3 6")).find("does not exist"), std::string::npos);
  EXPECT_NE(error_of(with("0 1 2 3 6", "0 1 1.5 3 6")).find("does not exist"), std::string::npos);
  EXPECT_NE(error_of(with("1 1 0 22", "1 nan 0 22")).find("not finite"), std::string::npos);
  EXPECT_NE(error_of(with("1 1 0 22", "1 1e60 0 22")).find("not finite"), std::string::npos);
  EXPECT_NE(error_of(with("list uchar int", "list float int")).find("integer"), std::string::npos);
  EXPECT_NE(error_of(with("element face 1", "element vertex 1")).find("two vertex"), std::string::npos);
}

TEST_F(Ply, MissingFileAndFolderAreSentences) {
  EXPECT_FALSE(read_ply(folder_.path() / "absent.ply").has_value());
  EXPECT_FALSE(read_ply(folder_.path()).has_value());
}

}  // namespace
}  // namespace tactus::evaluate
