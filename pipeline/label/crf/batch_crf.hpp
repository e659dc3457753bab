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
  struct Lattice {
    std::size_t vertices_max = 0, slots_max = 0;  ///< dense_crf.hpp
  };
  std::size_t points_max = 0;
  Lattice smoothness, appearance, surface;

  /// Room for rooms: with the paper's bandwidths at cells of 1 cm the authors' cloud of 60,638 points
  /// needs 1.6, 0.3 and 3.4 vertices a point, and 7.2, 1.6 and 16.2 slots.
  static constexpr BatchCrfConfig for_points(std::size_t count) {
    return {count, {2 * count, 9 * count}, {count, 7 * count}, {5 * count, 24 * count}};
  }
  /// Room for anything: no two points share a vertex, and yet each has all neighbours.
  static constexpr BatchCrfConfig for_any_points(std::size_t count) {
    return {count, {4 * count, 20 * count}, {7 * count, 56 * count}, {7 * count, 56 * count}};
  }
};

/// The engine that holds the three kernels of eq. (3) over at most this many points.
[[nodiscard]] DenseCrfConfig surface_engine_config(const BatchCrfConfig& config) noexcept;

inline constexpr std::size_t kSmoothness = 0, kAppearance = 1, kSurface = 2;

/// Adds kernel kSmoothness, kAppearance or kSurface of eq. (3) to an engine made by surface_engine_config(),
/// its points in the order given (as they come where that is empty). Errors as DenseCrf::add_kernel(). Phase:
/// any.
[[nodiscard]] rt::Status add_surface_kernel(DenseCrf& engine, std::size_t kernel, const CrfPoints& points,
                                            std::span<const std::uint32_t> order,
                                            const CrfParameters& parameters) noexcept;

/// The same up to where DenseCrf::continue_kernel() goes on. Phase: any.
void begin_surface_kernel(DenseCrf& engine, std::size_t kernel, const CrfPoints& points,
                          std::span<const std::uint32_t> order, const CrfParameters& parameters) noexcept;

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
