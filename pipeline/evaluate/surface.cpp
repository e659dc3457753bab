#include "pipeline/evaluate/surface.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace tactus::evaluate {
namespace {

Vec3f low_of(const Vec3f& a, const Vec3f& b) {
  return {std::min(a.x, b.x), std::min(a.y, b.y), std::min(a.z, b.z)};
}
Vec3f high_of(const Vec3f& a, const Vec3f& b) {
  return {std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)};
}

double box_distance_squared(const Vec3d& p, const Vec3f& low, const Vec3f& high) {
  const auto outside = [](double v, float lo, float hi) {
    return std::max({static_cast<double>(lo) - v, 0.0, v - static_cast<double>(hi)});
  };
  const double x = outside(p.x, low.x, high.x), y = outside(p.y, low.y, high.y),
               z = outside(p.z, low.z, high.z);
  return x * x + y * y + z * z;
}

double segment_distance_squared(const Vec3d& p, const Vec3d& a, const Vec3d& b) {
  const Vec3d ab = b - a;
  const double length_squared = ab.dot(ab);
  const double t = length_squared > 0 ? std::clamp((p - a).dot(ab) / length_squared, 0.0, 1.0) : 0.0;
  const Vec3d d = p - (a + ab * t);
  return d.dot(d);
}

}  // namespace

double triangle_distance_squared(const Vec3d& p, const Vec3d& a, const Vec3d& b, const Vec3d& c) {
  const Vec3d ab = b - a, ac = c - a, ap = p - a;
  const Vec3d normal = ab.cross(ac);
  const double area_squared = normal.dot(normal);
  if (area_squared > 0) {
    // Barycentric coordinates of the projection: inside the triangle the plane's distance is the answer.
    const double v = ap.cross(ac).dot(normal) / area_squared;
    const double w = ab.cross(ap).dot(normal) / area_squared;
    if (v >= 0 && w >= 0 && v + w <= 1) {
      const double h = ap.dot(normal);
      return h * h / area_squared;
    }
  }
  return std::min({segment_distance_squared(p, a, b), segment_distance_squared(p, b, c),
                   segment_distance_squared(p, c, a)});
}

struct MeshDistance::Builder {
  static constexpr std::uint32_t kLeafCount = 4;

  MeshDistance& tree;
  std::vector<Vec3f> low, high;

  void build(std::uint32_t first, std::uint32_t count) {
    const std::size_t index = tree.nodes_.size();
    tree.nodes_.emplace_back();
    Vec3f lo = low[tree.order_[first]], hi = high[tree.order_[first]];
    for (std::uint32_t i = first; i < first + count; ++i) {
      lo = low_of(lo, low[tree.order_[i]]);
      hi = high_of(hi, high[tree.order_[i]]);
    }
    tree.nodes_[index].low = lo;
    tree.nodes_[index].high = hi;
    if (count <= kLeafCount) {
      tree.nodes_[index].first = first;
      tree.nodes_[index].count = count;
      return;
    }
    const Vec3f size = hi - lo;
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const auto center = [&](std::uint32_t i) {
      const Vec3f c = low[i] + high[i];
      return axis == 0 ? c.x : axis == 1 ? c.y : c.z;
    };
    const std::uint32_t left_count = count / 2;
    const auto begin = tree.order_.begin() + first;
    std::nth_element(begin, begin + left_count, begin + count,
                     [&](std::uint32_t a, std::uint32_t b) { return center(a) < center(b); });
    build(first, left_count);
    tree.nodes_[index].first = static_cast<std::uint32_t>(tree.nodes_.size());
    build(first + left_count, count - left_count);
  }
};

MeshDistance::MeshDistance(const Mesh& mesh) : vertices_(mesh.vertices_m), triangles_(mesh.triangles) {
  const std::size_t count = triangles_.empty() ? vertices_.size() : triangles_.size();
  if (count == 0) return;
  order_.resize(count);
  std::iota(order_.begin(), order_.end(), 0u);
  Builder builder{*this, std::vector<Vec3f>(count), std::vector<Vec3f>(count)};
  for (std::size_t i = 0; i < count; ++i) {
    if (triangles_.empty()) {
      builder.low[i] = builder.high[i] = vertices_[i];
      continue;
    }
    const Vec3f &a = vertices_[triangles_[i][0]], &b = vertices_[triangles_[i][1]],
                &c = vertices_[triangles_[i][2]];
    builder.low[i] = low_of(a, low_of(b, c));
    builder.high[i] = high_of(a, high_of(b, c));
  }
  builder.build(0, static_cast<std::uint32_t>(count));
}

double MeshDistance::primitive_distance_squared(const Vec3d& p, std::uint32_t primitive) const {
  if (triangles_.empty()) {
    const Vec3d d = p - vertices_[primitive].cast<double>();
    return d.dot(d);
  }
  const auto& t = triangles_[primitive];
  return triangle_distance_squared(p, vertices_[t[0]].cast<double>(), vertices_[t[1]].cast<double>(),
                                   vertices_[t[2]].cast<double>());
}

MeshDistance::Nearest MeshDistance::nearest(const Vec3d& p_m) const {
  Nearest best;
  if (nodes_.empty()) return best;
  struct Visit {
    std::uint32_t node;
    double distance_squared;
  };
  // Median splits halve the count: 2^32 primitives are 32 levels deep, one waiting sibling each.
  std::array<Visit, 64> stack;
  std::size_t waiting = 0;
  stack[waiting++] = {0, box_distance_squared(p_m, nodes_[0].low, nodes_[0].high)};
  double best_squared = std::numeric_limits<double>::infinity();
  while (waiting > 0) {
    const Visit visit = stack[--waiting];
    if (visit.distance_squared >= best_squared) continue;
    const Node& node = nodes_[visit.node];
    if (node.count > 0) {
      for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
        const double d = primitive_distance_squared(p_m, order_[i]);
        if (d < best_squared) {
          best_squared = d;
          best.primitive = order_[i];
        }
      }
      continue;
    }
    const std::uint32_t left = visit.node + 1, right = node.first;
    const double d_left = box_distance_squared(p_m, nodes_[left].low, nodes_[left].high);
    const double d_right = box_distance_squared(p_m, nodes_[right].low, nodes_[right].high);
    TACTUS_ASSERT(waiting + 2 <= stack.size());
    const bool left_first = d_left <= d_right;
    stack[waiting++] = left_first ? Visit{right, d_right} : Visit{left, d_left};
    stack[waiting++] = left_first ? Visit{left, d_left} : Visit{right, d_right};
  }
  best.distance_m = std::sqrt(best_squared);
  return best;
}

std::vector<SurfaceSample> sample_surface(const Mesh& mesh, std::size_t count) {
  std::vector<double> area_until(mesh.triangles.size());
  double area = 0;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& t = mesh.triangles[i];
    const Vec3d a = mesh.vertices_m[t[0]].cast<double>();
    const Vec3d ab = mesh.vertices_m[t[1]].cast<double>() - a, ac = mesh.vertices_m[t[2]].cast<double>() - a;
    area += ab.cross(ac).norm() / 2;
    area_until[i] = area;
  }
  std::vector<SurfaceSample> samples;
  if (!(area > 0)) {
    for (std::size_t i = 0; i < mesh.vertices_m.size(); ++i)
      samples.push_back(
          {mesh.vertices_m[i], mesh.vertex_labels.empty() ? kUnknownMaterial : mesh.vertex_labels[i]});
    return samples;
  }
  // The R2 sequence: multiples of 1/g and 1/g^2 modulo 1, g the plastic number (g^3 = g + 1).
  constexpr double kStepU = 0.7548776662466927, kStepV = 0.5698402909980532;
  samples.reserve(count);
  std::size_t triangle = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const double target = area * (static_cast<double>(k) + 0.5) / static_cast<double>(count);
    while (triangle + 1 < area_until.size() && area_until[triangle] < target) ++triangle;
    double u = static_cast<double>(k) * kStepU, v = static_cast<double>(k) * kStepV;
    u -= std::floor(u);
    v -= std::floor(v);
    if (u + v > 1) {
      u = 1 - u;
      v = 1 - v;
    }
    const auto& t = mesh.triangles[triangle];
    const Vec3d a = mesh.vertices_m[t[0]].cast<double>();
    const Vec3d ab = mesh.vertices_m[t[1]].cast<double>() - a, ac = mesh.vertices_m[t[2]].cast<double>() - a;
    samples.push_back({(a + ab * u + ac * v).cast<float>(), mesh.triangle_label(triangle)});
  }
  return samples;
}

ConfusionMatrix compare_labels(std::span<const SurfaceSample> samples, const Alignment& T_truth_estimate,
                               const Mesh& truth, const MeshDistance& distance, double distance_m_max) {
  ConfusionMatrix confusion;
  for (const SurfaceSample& sample : samples) {
    const MeshDistance::Nearest nearest =
        distance.nearest(T_truth_estimate * sample.position_m.cast<double>());
    if (!(nearest.distance_m <= distance_m_max)) continue;
    const MaterialId label = !truth.triangles.empty()       ? truth.triangle_label(nearest.primitive)
                             : !truth.vertex_labels.empty() ? truth.vertex_labels[nearest.primitive]
                                                            : kUnknownMaterial;
    confusion.add(label, sample.label);
  }
  return confusion;
}

}  // namespace tactus::evaluate
