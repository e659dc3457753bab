#include "pipeline/map/mesh.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <numbers>
#include <random>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include "pipeline/label/label_cell.hpp"
#include "tests/pipeline/map/analytic_map.hpp"

namespace tactus::map::test {
namespace {

constexpr MapConfig kConfig{0.01f, 0.04f, 2048};
constexpr Vec3d kCentre{0.013, -0.021, 0.008};
constexpr double kRadius = 0.2;

double sphere_distance(const Vec3d& p) { return (p - kCentre).norm() - kRadius; }

const Vec3d kPlaneNormal = Vec3d{0.3, 0.8, -0.52}.normalized();
double plane_distance(const Vec3d& p) { return kPlaneNormal.dot(p) - 0.017; }

// Times that each directed edge is used.
std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges_of(const Mesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const MeshTriangle& t : mesh.triangles)
    for (std::size_t i = 0; i < 3; ++i) ++edges[{t[i], t[(i + 1) % 3]}];
  return edges;
}

double volume(const Mesh& mesh) {
  double sum = 0;
  for (const MeshTriangle& t : mesh.triangles) {
    const auto p = [&](std::size_t i) { return mesh.vertices[t[i]].position_world_m.cast<double>(); };
    sum += p(0).dot(p(1).cross(p(2))) / 6;
  }
  return sum;
}

Vec3d triangle_normal(const Mesh& mesh, const MeshTriangle& t) {
  const auto p = [&](std::size_t i) { return mesh.vertices[t[i]].position_world_m.cast<double>(); };
  return (p(1) - p(0)).cross(p(2) - p(0));
}

void expect_no_duplicates(const Mesh& mesh) {
  std::set<std::tuple<float, float, float>> places;
  std::vector<bool> is_used(mesh.vertices.size());
  for (const MeshVertex& v : mesh.vertices)
    places.insert({v.position_world_m.x, v.position_world_m.y, v.position_world_m.z});
  for (const MeshTriangle& t : mesh.triangles)
    for (const std::uint32_t v : t) {
      ASSERT_LT(v, mesh.vertices.size());
      is_used[v] = true;
    }
  EXPECT_EQ(places.size(), mesh.vertices.size());
  EXPECT_EQ(std::count(is_used.begin(), is_used.end(), false), 0) << "vertices without a triangle";
}

TEST(Mesh, EmptyMapHasNone) {
  OwnedMap sut(kConfig);
  const Mesh mesh = extract_mesh(sut.map);
  EXPECT_TRUE(mesh.vertices.empty());
  EXPECT_TRUE(mesh.triangles.empty());
}

TEST(Mesh, SphereIsClosedRoundAndOutward) {
  OwnedMap sut(kConfig);
  fill(sut.map, {-0.3, -0.3, -0.3}, {0.3, 0.3, 0.3}, sphere_distance);
  const Mesh mesh = extract_mesh(sut.map);
  ASSERT_GT(mesh.vertices.size(), 5000u);
  double error_max = 0, normal_min = 1;
  for (const MeshVertex& v : mesh.vertices) {
    const Vec3d p = v.position_world_m.cast<double>();
    error_max = std::max(error_max, std::fabs(sphere_distance(p)));
    normal_min = std::min(normal_min, v.normal_world.cast<double>().dot((p - kCentre).normalized()));
    EXPECT_NEAR(v.normal_world.norm(), 1, 1e-5f);
    EXPECT_EQ(v.color, (Rgb8{100, 100, 100}));
    EXPECT_EQ(v.label, kUnknownMaterial);
    EXPECT_EQ(v.confidence, 0);
  }
  std::printf("sphere: %zu vertices, off by at most %.3f mm, normals by %.3f degrees\n", mesh.vertices.size(),
              1e3 * error_max, std::acos(normal_min) * 180 / std::numbers::pi);
  EXPECT_LT(error_max, 0.0002);  // h^2 / 8 R = 0.06 mm is the chord's; 1.5 mm would do
  EXPECT_GT(normal_min, 0.999);
  const auto edges = edges_of(mesh);
  for (const auto& [edge, times] : edges) {
    ASSERT_EQ(times, 1);
    ASSERT_EQ(edges.count({edge.second, edge.first}), 1u) << "an open edge";
  }
  EXPECT_EQ(mesh.vertices.size() - edges.size() / 2 + mesh.triangles.size(), 2u)
      << "Euler: one closed surface";
  EXPECT_NEAR(volume(mesh), 4.0 / 3 * std::numbers::pi * kRadius * kRadius * kRadius, 1e-4);
  for (const MeshTriangle& t : mesh.triangles)
    ASSERT_GT(triangle_normal(mesh, t).dot(mesh.vertices[t[0]].normal_world.cast<double>()), 0);
  expect_no_duplicates(mesh);
}

TEST(Mesh, PlaneIsFlatAndSeenFromItsFront) {
  OwnedMap sut(kConfig);
  fill(sut.map, {-0.3, -0.3, -0.3}, {0.3, 0.3, 0.3}, plane_distance);
  const Mesh mesh = extract_mesh(sut.map);
  ASSERT_GT(mesh.triangles.size(), 3000u);
  for (const MeshVertex& v : mesh.vertices) {
    EXPECT_NEAR(plane_distance(v.position_world_m.cast<double>()), 0, 0.00002);
    EXPECT_GT(v.normal_world.cast<double>().dot(kPlaneNormal), 0.9999);
  }
  for (const MeshTriangle& t : mesh.triangles) ASSERT_GE(triangle_normal(mesh, t).dot(kPlaneNormal), 0);
  expect_no_duplicates(mesh);
}

TEST(Mesh, SurfaceThroughVoxelCentresHasNoDuplicates) {
  OwnedMap sut(kConfig);
  fill(sut.map, {-0.2, -0.2, -0.2}, {0.2, 0.2, 0.2}, [](const Vec3d& p) { return p.y - 0.05; });
  const Mesh mesh = extract_mesh(sut.map);
  ASSERT_GT(mesh.triangles.size(), 1000u);
  for (const MeshVertex& v : mesh.vertices) EXPECT_NEAR(v.position_world_m.y, 0.05f, 0.00002f);
  expect_no_duplicates(mesh);
}

TEST(Mesh, UnobservedVoxelsMakeNoSurface) {
  OwnedMap sut(kConfig);
  fill(sut.map, {-0.3, -0.3, -0.3}, {0.3, 0.3, 0.3}, sphere_distance,
       [](const Vec3d& p) { return p.x > 0.0501; });
  const Mesh mesh = extract_mesh(sut.map);
  ASSERT_GT(mesh.triangles.size(), 1000u);
  float least = 1;
  for (const MeshVertex& v : mesh.vertices) {
    least = std::min(least, v.position_world_m.x);
    EXPECT_NEAR(sphere_distance(v.position_world_m.cast<double>()), 0, 0.0002);
  }
  EXPECT_GE(least, 0.06f);
  EXPECT_LT(least, 0.062f) << "and up to there it goes";
}

TEST(Mesh, ThinlyObservedVoxelsAreLeftOutOnRequest) {
  OwnedMap sut(kConfig);
  fill(sut.map, {-0.3, -0.3, -0.3}, {0.3, 0.3, 0.3}, sphere_distance);
  MeshConfig config;
  config.weight_min = 10;
  EXPECT_FALSE(extract_mesh(sut.map, config).triangles.empty());
  config.weight_min = 11;
  EXPECT_TRUE(extract_mesh(sut.map, config).triangles.empty());
}

TEST(Mesh, OrderDependsOnContentAlone) {
  OwnedMap sut(kConfig), other(kConfig);
  fill(sut.map, {-0.3, -0.3, -0.3}, {0.3, 0.3, 0.3}, sphere_distance);
  // The same content after another history: other blocks first, some evicted and made again.
  fill(other.map, {0.5, 0.5, 0.5}, {0.8, 0.8, 0.8}, [](const Vec3d& p) { return p.x - 0.6; });
  std::vector<BlockIndex> gone;
  live_blocks(other.map, gone);
  fill(other.map, {0.1, -0.3, -0.3}, {0.3, 0.3, 0.3}, sphere_distance);
  for (const BlockIndex b : gone) other.map.evict(b);
  fill(other.map, {-0.3, -0.3, -0.3}, {0.3, 0.3, 0.3}, sphere_distance);
  const Mesh a = extract_mesh(sut.map), b = extract_mesh(other.map);
  ASSERT_EQ(a.vertices.size(), b.vertices.size());
  EXPECT_EQ(a.triangles, b.triangles);
  for (std::size_t i = 0; i < a.vertices.size(); ++i) {
    ASSERT_EQ(a.vertices[i].position_world_m, b.vertices[i].position_world_m);
    ASSERT_EQ(a.vertices[i].normal_world, b.vertices[i].normal_world);
  }
}

// All 256 cases beside each other in every combination that noise makes: the surface has no hole and no
// triangle turned over, because neighbours agree on the face that they share.
TEST(Mesh, NoiseGivesClosedOrientedSurfaces) {
  for (std::uint32_t seed = 1; seed <= 5; ++seed) {
    OwnedMap sut(kConfig);
    std::mt19937 random(seed);
    std::map<std::tuple<int, int, int>, double> noise;
    fill(sut.map, {-0.15, -0.15, -0.15}, {0.15, 0.15, 0.15}, [&](const Vec3d& p) {
      const int x = static_cast<int>(std::lround(p.x * 100)), y = static_cast<int>(std::lround(p.y * 100)),
                z = static_cast<int>(std::lround(p.z * 100));
      if (std::max({std::abs(x), std::abs(y), std::abs(z)}) > 11) return 0.03;
      const auto [it, is_new] = noise.try_emplace({x, y, z}, 0.0);
      if (is_new) it->second = std::uniform_real_distribution<double>(-0.03, 0.03)(random);
      return it->second;
    });
    const Mesh mesh = extract_mesh(sut.map);
    ASSERT_GT(mesh.triangles.size(), 10000u) << "seed " << seed;
    const auto edges = edges_of(mesh);
    for (const auto& [edge, times] : edges) {
      const auto back = edges.find({edge.second, edge.first});
      ASSERT_NE(back, edges.end()) << "seed " << seed;
      ASSERT_EQ(back->second, times) << "seed " << seed;
    }
    EXPECT_GT(volume(mesh), 0) << "seed " << seed;
    expect_no_duplicates(mesh);
  }
}

TEST(Mesh, LabelsComeFromTheCellsAndFilterTheExport) {
  constexpr MaterialId kGlass = 6, kWood = 22;
  OwnedMap sut(kConfig);
  fill(sut.map, {-0.3, -0.3, -0.3}, {0.3, 0.3, 0.3}, sphere_distance);
  const auto word_of = [](MaterialId id, std::uint8_t byte) {
    std::array<std::uint8_t, kMaterialCount> bytes{};
    bytes[id] = byte;
    bytes[9] = static_cast<std::uint8_t>(255 - byte);
    return label::fuse(0, label::costs_of(bytes));
  };
  const LabelWord glass = word_of(kGlass, 230), wood = word_of(kWood, 180);
  std::vector<BlockIndex> blocks;
  live_blocks(sut.map, blocks);
  for (const BlockIndex b : blocks) {
    std::array<LabelWord, kBlockCells> words;
    const int x = coord_of(sut.map.key(b)).x;
    words.fill(x < -1 ? glass : x > 0 ? wood : 0);
    sut.map.publish_labels(b, words, 1);
  }
  const Mesh all = extract_mesh(sut.map);
  for (const MeshVertex& v : all.vertices) {
    const float x = v.position_world_m.x;  // blocks -1 and 0 hold voxels at -0.08 .. 0.07
    if (x < -0.09f) {
      ASSERT_EQ(v.label, kGlass);
      ASSERT_EQ(v.confidence, label::confidence(glass));
    } else if (x > 0.08f) {
      ASSERT_EQ(v.label, kWood);
      ASSERT_NEAR(v.confidence, 180.0f / 265, 0.02f);
    } else if (x > -0.08f && x < 0.07f) {
      ASSERT_EQ(v.label, kUnknownMaterial);
    }
  }
  MeshConfig config;
  config.material_only = kGlass;
  const Mesh only = extract_mesh(sut.map, config);
  ASSERT_GT(only.triangles.size(), 1000u);
  EXPECT_LT(only.triangles.size(), all.triangles.size() / 2);
  for (const MeshTriangle& t : only.triangles) {
    int votes = 0;
    for (const std::uint32_t v : t) votes += only.vertices[v].label == kGlass;
    ASSERT_GE(votes, 2);
  }
  expect_no_duplicates(only);
  config.material_only = 3;
  EXPECT_TRUE(extract_mesh(sut.map, config).vertices.empty());
}

}  // namespace
}  // namespace tactus::map::test
