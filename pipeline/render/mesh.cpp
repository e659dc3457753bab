#include "pipeline/render/mesh.hpp"

#include <algorithm>
#include <cmath>
#include <string>

namespace tactus::render {
namespace {

constexpr int kSides = 32, kRingsPerCap = 8;
constexpr float kPi = 3.14159265F;

class Builder {
 public:
  explicit Builder(MeshSet& set) : set_(set), first_index_(set.indices.size()) {}

  std::uint16_t add(const MeshVertex& vertex) {
    set_.vertices.push_back(vertex);
    return static_cast<std::uint16_t>(set_.vertices.size() - 1);
  }
  void triangle(int a, int b, int c) {
    for (const int i : {a, b, c}) set_.indices.push_back(static_cast<std::uint16_t>(i));
  }
  [[nodiscard]] int next() const { return static_cast<int>(set_.vertices.size()); }
  void finish() {
    set_.ranges.push_back({static_cast<std::uint32_t>(first_index_),
                           static_cast<std::uint32_t>(set_.indices.size() - first_index_)});
  }

 private:
  MeshSet& set_;
  std::size_t first_index_;
};

void add_box(MeshSet& set) {
  Builder builder(set);
  for (int axis = 0; axis < 3; ++axis)
    for (const float side : {-1.0F, 1.0F}) {
      const int first = builder.next();
      for (const auto& [a, b] : {std::pair{-1.0F, -1.0F}, {1.0F, -1.0F}, {1.0F, 1.0F}, {-1.0F, 1.0F}}) {
        float p[3], n[3] = {};
        p[axis] = n[axis] = side;
        p[(axis + 1) % 3] = a;
        p[(axis + 2) % 3] = b;
        builder.add({{p[0], p[1], p[2]}, {n[0], n[1], n[2]}, 0});
      }
      // Counter-clockwise from outside: the pass of shadows draws back faces only.
      const int second = side > 0 ? first + 1 : first + 3, fourth = side > 0 ? first + 3 : first + 1;
      builder.triangle(first, second, first + 2);
      builder.triangle(first, first + 2, fourth);
    }
  builder.finish();
}

Vec3f around(int side) {
  const float angle = 2 * kPi * static_cast<float>(side) / kSides;
  return {std::cos(angle), std::sin(angle), 0};
}

/// Quads between two rings of kSides vertices each.
void join_rings(Builder& builder, int ring, int other) {
  for (int i = 0; i < kSides; ++i) {
    const int j = (i + 1) % kSides;
    builder.triangle(ring + i, ring + j, other + j);
    builder.triangle(ring + i, other + j, other + i);
  }
}

void add_cylinder(MeshSet& set) {
  Builder builder(set);
  const int side = builder.next();
  for (const float z : {-1.0F, 1.0F})
    for (int i = 0; i < kSides; ++i) builder.add({around(i) + Vec3f{0, 0, z}, around(i), 0});
  join_rings(builder, side, side + kSides);
  for (const float z : {-1.0F, 1.0F}) {
    const int middle = builder.add({{0, 0, z}, {0, 0, z}, 0});
    for (int i = 0; i < kSides; ++i) builder.add({around(i) + Vec3f{0, 0, z}, {0, 0, z}, 0});
    for (int i = 0; i < kSides; ++i) builder.triangle(middle, middle + 1 + i, middle + 1 + (i + 1) % kSides);
  }
  builder.finish();
}

void add_capsule(MeshSet& set) {
  Builder builder(set);
  int ring = -1;
  // From the lower pole to its equator, then from the upper equator to its pole; poles are rings of one
  // point.
  for (const float cap : {-1.0F, 1.0F})
    for (int k = 0; k <= kRingsPerCap; ++k) {
      const int step = cap < 0 ? k - kRingsPerCap : k;
      const float latitude = kPi / 2 * static_cast<float>(step) / kRingsPerCap;
      const int next_ring = builder.next();
      for (int i = 0; i < kSides; ++i) {
        const Vec3f p = around(i) * std::cos(latitude) + Vec3f{0, 0, std::sin(latitude)};
        builder.add({p, p, cap});
      }
      if (ring >= 0) join_rings(builder, ring, next_ring);
      ring = next_ring;
    }
  builder.finish();
}

void add_hull(MeshSet& set, const HullMesh& hull) {
  Builder builder(set);
  for (const auto& triangle : hull.triangles) {
    const Vec3f a = hull.vertices_m[triangle[0]], b = hull.vertices_m[triangle[1]],
                c = hull.vertices_m[triangle[2]];
    Vec3f normal = (b - a).cross(c - a).normalized();
    if (normal.dot(a + b + c) < 0) normal = -normal;
    const int first = builder.next();
    for (const Vec3f& p : {a, b, c}) builder.add({p, normal, 0});
    builder.triangle(first, first + 1, first + 2);
  }
  builder.finish();
}

rt::Error refuse(std::size_t hull, const char* what) {
  return {rt::ExitCode::bad_usage, "render: hull " + std::to_string(hull) + " " + what};
}

}  // namespace

rt::Result<MeshSet> build_meshes(std::span<const HullMesh> hulls) {
  if (hulls.size() > kMeshesMax - kFirstHullMesh)
    return rt::Error{rt::ExitCode::bad_usage, "render: " + std::to_string(hulls.size()) +
                                                  " hulls do not fit; at most " +
                                                  std::to_string(kMeshesMax - kFirstHullMesh) + " do"};
  MeshSet set;
  add_box(set);
  add_cylinder(set);
  add_capsule(set);
  for (std::size_t i = 0; i < hulls.size(); ++i) {
    if (set.vertices.size() + 3 * hulls[i].triangles.size() > 65535)
      return refuse(i, "is one too many: all meshes together hold at most 65535 vertices, three a triangle");
    for (const Vec3f& p : hulls[i].vertices_m)
      if (!std::isfinite(p.x + p.y + p.z)) return refuse(i, "has a vertex that is not finite");
    for (const auto& triangle : hulls[i].triangles)
      for (const std::uint16_t index : triangle)
        if (index >= hulls[i].vertices_m.size())
          return refuse(i, "has a triangle whose vertex does not exist");
    add_hull(set, hulls[i]);
  }
  return set;
}

float radius_of(const HullMesh& hull) {
  float radius_m = 0;
  for (const Vec3f& p : hull.vertices_m) radius_m = std::max(radius_m, p.norm());
  return radius_m;
}

}  // namespace tactus::render
