// The field over all surface points of a map at once, by permutohedral lattice: the reference for whatever
// refines the map piece by piece.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "pipeline/label/crf/crf.hpp"
#include "pipeline/label/crf/dense_crf.hpp"
#include "rt/slice.hpp"
#include "rt/status.hpp"

namespace tactus::label {

struct BatchCrfConfig {
  std::size_t points_max = 0;
  /// Lattice vertices of the three kernels. A point has 4, 7 and 7, most of them shared with others.
  std::size_t smoothness_vertices_max = 0, appearance_vertices_max = 0, surface_vertices_max = 0;

  /// Room for rooms: with bandwidths of 3 points' spacing or more, the authors' cloud of 60,638 points needs
  /// 0.4, 0.2 and 2.4 vertices a point.
  static constexpr BatchCrfConfig for_points(std::size_t count) { return {count, count, count, 4 * count}; }
  /// Room for anything: no two points share a vertex.
  static constexpr BatchCrfConfig for_any_points(std::size_t count) {
    return {count, 4 * count, 7 * count, 7 * count};
  }
};

/// prepare() builds the lattices, solve() runs mean field; both may be called again at any time. Fixed
/// memory, no heap. Not thread-safe.
class BatchCrf {
 public:
  static std::size_t bytes_needed(const BatchCrfConfig& config);
  /// Phase: boot.
  void bind(rt::Slice& memory, const BatchCrfConfig& config);

  /// corrupt: invalid points or parameters, or a point more than 10,000 bandwidths from the origin; full:
  /// more points or vertices than bound. Nothing is left prepared then. Phase: any.
  rt::Status prepare(const CrfPoints& points, const CrfParameters& parameters) noexcept;

  /// Marginals [point][23] in the order of the points given to prepare(). Phase: any.
  CrfReport solve(std::span<float> marginals) noexcept;

  [[nodiscard]] const DenseCrf& engine() const noexcept { return engine_; }

 private:
  DenseCrf engine_;
  std::span<std::uint32_t> order_;  // place along the curve -> point
  std::span<std::uint64_t> keys_;   // scratch of the sort
  int iterations_max_ = 0;
  float settled_change_ = 0;
};

}  // namespace tactus::label
