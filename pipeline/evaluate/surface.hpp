// How far a reconstructed surface is from the true one. Command line and tests only: allocates.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "hal/transform.hpp"
#include "pipeline/evaluate/labels.hpp"
#include "pipeline/evaluate/mesh.hpp"
#include "pipeline/evaluate/statistics.hpp"
#include "pipeline/evaluate/trajectory.hpp"
#include "rt/status.hpp"

namespace tactus::evaluate {

/// Distance from points to the nearest triangle (or, for a mesh without faces, the nearest vertex): a
/// bounding volume tree, split at the median of the longest axis, 4 triangles a leaf. Immutable after build;
/// any thread may query.
class MeshDistance {
 public:
  explicit MeshDistance(const Mesh& mesh);

  struct Nearest {
    double distance_m = std::numeric_limits<double>::infinity();
    std::uint32_t primitive = 0;  // index of the triangle, or of the vertex for a mesh without faces
  };
  [[nodiscard]] Nearest nearest(const Vec3d& p_m) const;

 private:
  struct Node {
    Vec3f low, high;
    std::uint32_t first =
        0;  // leaf: first entry of order_; inner: index of the right child (the left one follows)
    std::uint32_t count = 0;  // leaf: entries; 0 for an inner node
  };
  struct Builder;
  [[nodiscard]] double primitive_distance_squared(const Vec3d& p, std::uint32_t primitive) const;

  std::vector<Vec3f> vertices_;
  std::vector<std::array<std::uint32_t, 3>> triangles_;
  std::vector<std::uint32_t> order_;
  std::vector<Node> nodes_;
};

/// Squared distance from p to the triangle a b c, degenerate ones included (Ericson, Real-Time Collision
/// Detection, 5.1.5).
double triangle_distance_squared(const Vec3d& p, const Vec3d& a, const Vec3d& b, const Vec3d& c);

/// A point on the surface that is judged, and the label there (255 where none).
struct SurfaceSample {
  Vec3f position_m;
  MaterialId label = kUnknownMaterial;
};

/// `count` points spread evenly over the area of the triangles: sample k lies at (k + 0.5) / count of the
/// area summed in file order, inside its triangle at the k-th point of a 2D low-discrepancy sequence. The
/// same mesh gives the same samples. A mesh without faces (or without area) gives its vertices.
std::vector<SurfaceSample> sample_surface(const Mesh& mesh, std::size_t count);

struct SurfaceReport {
  ErrorStatistics distance_m;
  double share_within_5mm = 0, share_within_10mm = 0, share_within_20mm = 0;
};

/// `distance_m(Vec3d) -> double` is the true distance in the truth's world (its sign is dropped): a
/// MeshDistance, or a scene that knows its exact distance.
template <typename Distance>
SurfaceReport evaluate_surface(std::span<const SurfaceSample> samples, const Alignment& T_truth_estimate,
                               const Distance& distance_m);

/// The labels at the samples against those of the nearest true triangle, where both meshes have labels.
ConfusionMatrix compare_labels(std::span<const SurfaceSample> samples, const Alignment& T_truth_estimate,
                               const Mesh& truth, const MeshDistance& distance, double distance_m_max);

template <typename Distance>
SurfaceReport evaluate_surface(std::span<const SurfaceSample> samples, const Alignment& T_truth_estimate,
                               const Distance& distance_m) {
  std::vector<double> errors_m;
  errors_m.reserve(samples.size());
  for (const SurfaceSample& sample : samples) {
    const double d = distance_m(T_truth_estimate * sample.position_m.template cast<double>());
    errors_m.push_back(d < 0 ? -d : d);
  }
  SurfaceReport report;
  report.distance_m = statistics(errors_m);  // sorts
  const auto share_within = [&](double limit_m) {
    std::size_t count = 0;
    while (count < errors_m.size() && errors_m[count] <= limit_m) ++count;
    return errors_m.empty() ? 0.0 : static_cast<double>(count) / static_cast<double>(errors_m.size());
  };
  report.share_within_5mm = share_within(0.005);
  report.share_within_10mm = share_within(0.010);
  report.share_within_20mm = share_within(0.020);
  return report;
}

}  // namespace tactus::evaluate
