#include "pipeline/map/mesh.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>

#include "pipeline/label/label_cell.hpp"

namespace tactus::map {
namespace {

// The case table. Corner k of a cube lies at (k & 1, k >> 1 & 1, k >> 2); an edge is 4 * axis + the position
// of its lower corner among the four that begin an edge along that axis.
//
// For a set of solid corners, walk each face's four corners counter-clockwise as seen from outside the cube.
// Every run of solid corners begins with a step into the solid and ends with a step out of it: a directed
// segment from the first crossed edge to the second. That is the whole rule; on an ambiguous face (two solid
// corners across the diagonal) it cuts each solid corner off for itself, and since it looks at nothing but
// the face, the two cubes that share a face agree. A cube edge belongs to two faces which walk it in opposite
// directions, so each crossed edge begins exactly one segment: the segments close to loops, which are cut
// into fans. Loops run counter-clockwise seen from free space.
constexpr int kTrianglesMax = 5;

struct Case {
  std::uint8_t triangles_count = 0;
  std::array<std::uint8_t, 3 * kTrianglesMax> edges{};
};

constexpr int lower_corner(int edge) {
  const int axis = edge / 4, b = (axis + 1) % 3, c = (axis + 2) % 3;
  return (edge & 1) << b | (edge >> 1 & 1) << c;
}

constexpr int edge_between(int corner, int other) {
  const int axis = std::countr_zero(static_cast<unsigned>(corner ^ other));
  const int low = corner & other;
  return 4 * axis + (low >> (axis + 1) % 3 & 1) + 2 * (low >> (axis + 2) % 3 & 1);
}

constexpr Case make_case(int solid) {
  std::array<int, 12> next{};
  next.fill(-1);
  for (int face = 0; face < 6; ++face) {
    const int axis = face >> 1, b = (axis + 1) % 3, c = (axis + 2) % 3;
    std::array<int, 4> corner{};
    for (int i = 0; i < 4; ++i) {
      const int turn = (face & 1) != 0 ? i : 3 - i;
      const int in_b = turn == 1 || turn == 2, in_c = turn >= 2;
      corner[static_cast<std::size_t>(i)] = (face & 1) << axis | in_b << b | in_c << c;
    }
    const auto is_solid = [&](int i) { return (solid >> corner[static_cast<std::size_t>(i & 3)] & 1) != 0; };
    const auto edge_from = [&](int i) {
      return edge_between(corner[static_cast<std::size_t>(i & 3)],
                          corner[static_cast<std::size_t>((i + 1) & 3)]);
    };
    for (int i = 0; i < 4; ++i) {
      if (is_solid(i) || !is_solid(i + 1)) continue;
      int end = i + 1;
      while (is_solid(end + 1)) ++end;
      next[static_cast<std::size_t>(edge_from(i))] = edge_from(end);
    }
  }
  Case result;
  std::array<bool, 12> done{};
  for (int first = 0; first < 12; ++first) {
    if (next[static_cast<std::size_t>(first)] < 0 || done[static_cast<std::size_t>(first)]) continue;
    done[static_cast<std::size_t>(first)] = true;
    int previous = next[static_cast<std::size_t>(first)];
    done[static_cast<std::size_t>(previous)] = true;
    for (int edge = next[static_cast<std::size_t>(previous)]; edge != first;
         edge = next[static_cast<std::size_t>(edge)]) {
      done[static_cast<std::size_t>(edge)] = true;
      const std::size_t at = 3 * std::size_t{result.triangles_count++};
      result.edges.at(at) = static_cast<std::uint8_t>(first);
      result.edges.at(at + 1) = static_cast<std::uint8_t>(previous);
      result.edges.at(at + 2) = static_cast<std::uint8_t>(edge);
      previous = edge;
    }
  }
  return result;
}

constexpr auto kCases = [] {
  std::array<Case, 256> cases{};
  for (int solid = 0; solid < 256; ++solid) cases[static_cast<std::size_t>(solid)] = make_case(solid);
  return cases;
}();
static_assert(kCases[0].triangles_count == 0 && kCases[255].triangles_count == 0);
static_assert(kCases[1].triangles_count == 1 && kCases[254].triangles_count == 1);
static_assert(kCases[0x0F].triangles_count == 2, "a flat cut");
static_assert(kCases[0x69].triangles_count == 4, "four corners, each for itself");

// A vertex this close to a lattice point would coincide with those of the point's other edges; 10 micrometres
// at 1 cm.
constexpr float kEndMargin = 1.0f / 1024.0f;

constexpr std::uint32_t kNoVertex = 0xFFFFFFFFu;
constexpr int kEdgesPerBlock = 3 * kBlockVoxels;

// A block's field with what surrounds it: -1 .. 9 along each axis. Blocks around: the 27 at -1, 0, 1.
class Neighbourhood {
 public:
  static constexpr int kSide = kBlockSide + 3;

  Neighbourhood(const Map& map, std::uint8_t weight_min) : map_(map), weight_min_(weight_min) {}

  void load(BlockKey key) {
    const BlockCoord c = coord_of(key);
    for (int i = 0; i < 27; ++i)
      around_[static_cast<std::size_t>(i)] =
          map_.find(key_of({c.x + i % 3 - 1, c.y + i / 3 % 3 - 1, c.z + i / 9 - 1}));
    std::size_t at = 0;
    for (int z = -1; z <= kBlockSide + 1; ++z)
      for (int y = -1; y <= kBlockSide + 1; ++y)
        for (int x = -1; x <= kBlockSide + 1; ++x, ++at) {
          const BlockIndex block = block_at(x, y, z);
          const auto voxel = static_cast<std::size_t>(voxel_index(in_block(x), in_block(y), in_block(z)));
          field_[at] = block != kNoBlock && map_.weight(block)[voxel] >= weight_min_ ? map_.tsdf(block)[voxel]
                                                                                     : kTsdfUnknown;
        }
  }
  [[nodiscard]] BlockIndex block_at(int x, int y, int z) const {
    const int i = (block_of(x) + 1) + 3 * ((block_of(y) + 1) + 3 * (block_of(z) + 1));
    return around_[static_cast<std::size_t>(i)];
  }
  [[nodiscard]] std::int16_t raw(int x, int y, int z) const {
    return field_[static_cast<std::size_t>((x + 1) + kSide * ((y + 1) + kSide * (z + 1)))];
  }
  /// Half a unit off zero, so that no voxel lies on the surface: 0.6 micrometres at 4 cm of truncation.
  [[nodiscard]] float value(int x, int y, int z) const { return static_cast<float>(raw(x, y, z)) + 0.5f; }

  /// Central difference where both sides are known, one-sided where one is.
  [[nodiscard]] Vec3f gradient(int x, int y, int z) const {
    const auto along = [&](int dx, int dy, int dz) {
      const bool up = raw(x + dx, y + dy, z + dz) != kTsdfUnknown,
                 down = raw(x - dx, y - dy, z - dz) != kTsdfUnknown;
      const float high = up ? value(x + dx, y + dy, z + dz) : value(x, y, z);
      const float low = down ? value(x - dx, y - dy, z - dz) : value(x, y, z);
      return up && down ? (high - low) * 0.5f : high - low;
    };
    return {along(1, 0, 0), along(0, 1, 0), along(0, 0, 1)};
  }

 private:
  const Map& map_;
  std::uint8_t weight_min_;
  std::array<BlockIndex, 27> around_{};
  std::array<std::int16_t, std::size_t{kSide} * kSide * kSide> field_{};
};

class Extractor {
 public:
  Extractor(const Map& map, const MeshConfig& config)
      : map_(map), near_(map, config.weight_min), row_of_block_(map.config().blocks_capacity, kNoVertex) {}

  Mesh run() {
    std::vector<BlockKey> keys;
    for (std::uint32_t b = 0; b < map_.config().blocks_capacity; ++b)
      if (const BlockKey key = map_.key(static_cast<BlockIndex>(b)); key != kNoKey) keys.push_back(key);
    std::sort(keys.begin(), keys.end());
    for (const BlockKey key : keys) block(key);
    return std::move(mesh_);
  }

 private:
  void block(BlockKey key) {
    near_.load(key);
    coord_ = coord_of(key);
    for (int z = 0; z < kBlockSide; ++z)
      for (int y = 0; y < kBlockSide; ++y)
        for (int x = 0; x < kBlockSide; ++x) cube(x, y, z);
  }

  void cube(int x, int y, int z) {
    unsigned solid = 0;
    for (int k = 0; k < 8; ++k) {
      const std::int16_t raw = near_.raw(x + (k & 1), y + (k >> 1 & 1), z + (k >> 2));
      if (raw == kTsdfUnknown) return;
      solid |= static_cast<unsigned>(raw < 0) << k;
    }
    const Case& found = kCases[solid];
    for (std::size_t t = 0; t < found.triangles_count; ++t) {
      MeshTriangle triangle;
      for (std::size_t i = 0; i < 3; ++i) {
        const int edge = found.edges[3 * t + i], low = lower_corner(edge);
        triangle[i] = vertex(x + (low & 1), y + (low >> 1 & 1), z + (low >> 2), edge / 4);
      }
      mesh_.triangles.push_back(triangle);
    }
  }

  // The vertex on the edge from a voxel along an axis; made when first asked for.
  std::uint32_t vertex(int x, int y, int z, int axis) {
    const BlockIndex owner = near_.block_at(x, y, z);
    std::uint32_t& row = row_of_block_[owner];
    if (row == kNoVertex) {
      row = static_cast<std::uint32_t>(vertex_of_edge_.size() / kEdgesPerBlock);
      vertex_of_edge_.resize(vertex_of_edge_.size() + kEdgesPerBlock, kNoVertex);
    }
    std::uint32_t& id = vertex_of_edge_[std::size_t{row} * kEdgesPerBlock +
                                        static_cast<std::size_t>(
                                            3 * voxel_index(in_block(x), in_block(y), in_block(z)) + axis)];
    if (id == kNoVertex) {
      id = static_cast<std::uint32_t>(mesh_.vertices.size());
      mesh_.vertices.push_back(make_vertex(x, y, z, axis));
    }
    return id;
  }

  [[nodiscard]] MeshVertex make_vertex(int x, int y, int z, int axis) const {
    const int ex = x + (axis == 0), ey = y + (axis == 1), ez = z + (axis == 2);
    const float from = near_.value(x, y, z), to = near_.value(ex, ey, ez);
    const float t = std::clamp(from / (from - to), kEndMargin, 1.0f - kEndMargin);
    MeshVertex v;
    // In double: the block's place would cost the float a digit of t.
    const auto size = static_cast<double>(map_.config().voxel_size_m);
    const auto place = [&](std::int32_t block, int voxel, bool is_along) {
      const double lattice = kBlockSide * block + voxel + (is_along ? static_cast<double>(t) : 0.0);
      return static_cast<float>(lattice * size);
    };
    v.position_world_m = {place(coord_.x, x, axis == 0), place(coord_.y, y, axis == 1),
                          place(coord_.z, z, axis == 2)};
    v.normal_world = (near_.gradient(x, y, z) * (1.0f - t) + near_.gradient(ex, ey, ez) * t).normalized();
    const bool is_nearer_end = t > 0.5f;
    const auto color = color_near(x, y, z, ex, ey, ez, is_nearer_end);
    v.color = color;
    const Labelled begin = label_at(x, y, z), end = label_at(ex, ey, ez);
    const Labelled nearer = is_nearer_end ? end : begin, other = is_nearer_end ? begin : end;
    v.label = nearer.material != kUnknownMaterial ? nearer.material : other.material;
    v.confidence = nearer.material != kUnknownMaterial ? nearer.confidence : other.confidence;
    return v;
  }

  // Of the voxel nearer to the vertex; when that knows nothing, of the other.
  [[nodiscard]] Rgb8 color_near(int x, int y, int z, int ex, int ey, int ez, bool is_nearer_end) const {
    const ColorCell begin = color_at(x, y, z), end = color_at(ex, ey, ez);
    const bool take_end = is_nearer_end ? end.weight > 0 || begin.weight == 0 : begin.weight == 0;
    const ColorCell& c = take_end ? end : begin;
    return c.weight > 0 ? Rgb8{c.r, c.g, c.b} : kUnknownColor;
  }
  [[nodiscard]] static std::size_t cell_at(int x, int y, int z) {
    return static_cast<std::size_t>(cell_of_voxel(in_block(x), in_block(y), in_block(z)));
  }
  [[nodiscard]] ColorCell color_at(int x, int y, int z) const {
    return map_.color(near_.block_at(x, y, z))[cell_at(x, y, z)];
  }
  struct Labelled {
    MaterialId material;
    float confidence;
  };
  // As a reader sees it: what the CRF found, where it has come by.
  [[nodiscard]] Labelled label_at(int x, int y, int z) const {
    const BlockIndex block = near_.block_at(x, y, z);
    const std::size_t cell = cell_at(x, y, z);
    if (const label::RefinedWord refined = map_.refined_concurrent(block, static_cast<int>(cell)); refined != 0)
      return {label::refined_best(refined), label::refined_confidence(refined)};
    const LabelWord word = map_.labels(block)[cell];
    return {label::best(word), label::confidence(word)};
  }

  const Map& map_;
  Neighbourhood near_;
  BlockCoord coord_;
  std::vector<std::uint32_t> row_of_block_;
  std::vector<std::uint32_t> vertex_of_edge_;
  Mesh mesh_;
};

// Keeps the triangles of one material, and the vertices that they use.
void keep_material(Mesh& mesh, MaterialId material) {
  std::erase_if(mesh.triangles, [&](const MeshTriangle& t) {
    int votes = 0;
    for (const std::uint32_t v : t) votes += mesh.vertices[v].label == material;
    return votes < 2;
  });
  std::vector<std::uint32_t> renamed(mesh.vertices.size(), kNoVertex);
  std::vector<MeshVertex> kept;
  for (MeshTriangle& t : mesh.triangles)
    for (std::uint32_t& v : t) {
      if (renamed[v] == kNoVertex) {
        renamed[v] = static_cast<std::uint32_t>(kept.size());
        kept.push_back(mesh.vertices[v]);
      }
      v = renamed[v];
    }
  mesh.vertices = std::move(kept);
}

// Where the field is flat around a vertex, its triangles say where the surface looks.
void mend_normals(Mesh& mesh) {
  std::vector<bool> is_flat(mesh.vertices.size());
  bool any = false;
  for (std::size_t i = 0; i < is_flat.size(); ++i) {
    is_flat[i] = mesh.vertices[i].normal_world == Vec3f{};
    any = any || is_flat[i];
  }
  if (!any) return;
  for (const MeshTriangle& t : mesh.triangles) {
    const Vec3f a = mesh.vertices[t[0]].position_world_m;
    const Vec3f normal =
        (mesh.vertices[t[1]].position_world_m - a).cross(mesh.vertices[t[2]].position_world_m - a);
    for (const std::uint32_t v : t)
      if (is_flat[v]) mesh.vertices[v].normal_world += normal;
  }
  for (std::size_t i = 0; i < is_flat.size(); ++i)
    if (is_flat[i]) mesh.vertices[i].normal_world = mesh.vertices[i].normal_world.normalized();
}

}  // namespace

Mesh extract_mesh(const Map& map, const MeshConfig& config) {
  Mesh mesh = Extractor(map, config).run();
  mend_normals(mesh);
  if (config.material_only != kUnknownMaterial) keep_material(mesh, config.material_only);
  return mesh;
}

}  // namespace tactus::map
